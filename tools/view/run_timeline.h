#pragma once
// A run over its whole time: modes, events, errors and bounds, ages, computing times, the track and
// the fixes of the GPS receiver. Of a log or, growing, of a bus; the memory is bounded.

#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/geodesy.h"
#include "tools/view/value_series.h"

namespace rcs::view {

class RunTimeline {
 public:
  static constexpr std::size_t kMaxChanges = 5000;   ///< of each lane, and of the events
  static constexpr std::size_t kMaxPoints = 20'000;  ///< of the track, of the truth, and of fixes

  /// A message that is malformed or of another channel is ignored.
  /// @param time  not before that of the last call
  void add(std::string_view channel, const std::uint8_t* data, std::size_t size, Duration time);

  /// What is newer than `since`. If "generation" differs from that of the caller's last document,
  /// earlier content changed, too.
  [[nodiscard]] nlohmann::ordered_json json(Duration since) const;

 private:
  struct Change {
    double time_s = 0.0;
    std::string value;
    std::string note;
  };
  struct Event {
    double time_s = 0.0;
    std::string node;
    int severity = 0;
    std::string code;
    std::string text;
  };
  struct TrackPoint {
    double time_s = 0.0;
    Vec3 p_world = Vec3::Zero();
    bool gps = false;  ///< fixes are accepted
  };
  struct Fix {
    double time_s = 0.0;
    std::int64_t utime = 0;
    std::optional<Geodetic> position;  ///< of the receiver; nullopt: the log has no GPS_FIX
    Vec3 p_world = Vec3::Zero();       ///< without `position`: prediction and innovation
    std::int8_t type = 0;              ///< gps_fix_t::FIX_*
    double sigma_m = 0.0;
    int verdict = -1;        ///< -1: not used or not tested, 0: rejected, 1: accepted
    std::int8_t reason = 0;  ///< innovation_t::REASON_*
    double nis = 0.0;
  };
  struct Truth {
    std::int64_t utime = 0;
    Vec3 p_world = Vec3::Zero();  ///< frame of the datum of the truth
  };
  struct Belief {
    Duration time{};
    std::int64_t utime = 0;
    Vec3 p_world = Vec3::Zero();
  };

  void add(const nav_state_t& m, Duration time);
  void add(const integrity_t& m, Duration time);
  void add(const innovation_t& m, Duration time);
  void add(const registration_t& m, Duration time);
  void add(const gps_fix_t& m, Duration time);
  void add(const event_t& m, Duration time);
  void add(const cycle_t& m, Duration time);
  void add(const truth_t& m, Duration time);
  void add_state(const char* lane, const status_t& m, Duration time);
  void change(const char* lane, Duration time, std::string value, std::string note = "");
  void add_errors();
  template <class T>
  void thin(std::vector<T>* points);
  [[nodiscard]] int generation() const;

  std::map<std::string, ValueSeries> series_;
  std::map<std::string, std::vector<Change>> lanes_;
  std::vector<Event> events_;
  std::vector<TrackPoint> track_;
  std::vector<TrackPoint> truth_track_;
  std::vector<Fix> fixes_;
  std::optional<LocalFrame> world_;        // of WM
  std::optional<LocalFrame> truth_world_;  // of the truth
  std::deque<Truth> truths_;               // of the last seconds
  std::deque<Belief> beliefs_;             // that wait for a later truth
  std::optional<Vec3> newest_p_world_;     // of WM
  double min_track_step_m_ = 0.25;
  int thinned_ = 0;
  Duration last_{};
};

}  // namespace rcs::view
