#pragma once
// Fills the record of a drill from the bus during the run.

#include <map>
#include <vector>

#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/subfilter_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/log/log_file.h"
#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// Replacement for SIM_TRUTH in logs without it: the belief of an undisturbed run.
struct DrillReference {
  tools::Trajectory poses;
  Geodetic datum;
};

class DrillRecorder final : public BusTap {
 public:
  /// @param reference  nullptr: SIM_TRUTH
  /// @param log  also receives all messages except scans and points; may be nullptr
  DrillRecorder(const std::vector<Stimulus>& stimuli, const DrillReference* reference,
                LogWriter* log);

  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override;

  /// The record; call once, at the end.
  [[nodiscard]] DrillRecord take() { return std::move(record_); }
  /// The origin of frame world of the record.
  [[nodiscard]] const std::optional<Geodetic>& datum() const { return datum_; }

 private:
  template <class T, class Take>
  void with(const std::uint8_t* data, std::size_t size, T* message, Take take);
  /// A stamp by the clocks before a common jump: subtracts the jump with which the message is as
  /// old as the first one of its channel.
  [[nodiscard]] Stamp undisturbed(std::string_view channel, std::int64_t utime, Stamp due);
  void hash(std::string_view channel, const std::uint8_t* data, std::size_t size);
  void take(const truth_t& m);
  void take(const nav_state_t& m, Stamp due);
  void take(const gps_fix_t& m, Stamp due);
  void take(const innovation_t& m, Stamp due);
  void take(const integrity_t& m, Stamp due);
  void take(const subfilter_t& m, Stamp due);
  void take(const registration_t& m, Stamp due);

  std::vector<Duration> jumps_;  // common to all clocks
  std::map<std::string, Duration, std::less<>> first_age_;
  bool has_reference_;
  LogWriter* log_;
  std::optional<Geodetic> datum_;  // of the truth
  std::optional<Pose> T_truth_world_;
  Vec3 world_datum_deg_m_ = Vec3::Constant(1e9);
  DrillRecord record_;
  Duration to_sensor_time_{};  // offset from the time of the log

  truth_t truth_{};
  nav_state_t nav_{};
  gps_fix_t fix_{};
  innovation_t innovation_{};
  integrity_t integrity_{};
  subfilter_t subfilter_{};
  registration_t registration_{};
  event_t event_{};
};

}  // namespace rcs::drills
