#pragma once
// The DDS side of the gateway: one participant, two topics published, two received. No call on an
// open link blocks: writers drop samples instead of waiting, and takes are bounded.

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/gateway/dds_params.h"
#include "modules/gateway/stop_admission.h"
#include "modules/gateway/taken_samples.h"
#include "rcs/base/result.h"
#include "rcs/dds/entity.h"
#include "rcs/dds/identity.h"
#include "vehicle.h"

namespace rcs::gateway {

class DdsLink {
 public:
  static constexpr std::size_t kMaxCommands = 16;  ///< samples taken in one cycle
  static constexpr std::size_t kMaxStops =
      256;  ///< large enough that a flood delays no stop for long

  /// @param vehicle  name of the vehicle; partition of its writers
  static Result<std::unique_ptr<DdsLink>> open(const DdsParams& params, const std::string& vehicle);

  /// False: rejected by DDS, e.g. because a reader is too slow. Counted.
  bool write(const rcs_VehicleState& sample);
  bool write(const rcs_NodeStatus& sample);

  using Commands = TakenSamples<rcs_WaypointCommand, kMaxCommands>;
  using Stops = TakenSamples<rcs_EmergencyStop, kMaxStops>;
  [[nodiscard]] Commands take_commands() { return Commands(command_reader_.get()); }
  [[nodiscard]] Stops take_stops();
  /// Of an operator that was not stored (StopAdmission), since the last call.
  [[nodiscard]] bool take_unnamed_stop();
  /// A release in the name of another operator was not stored, since the last call.
  [[nodiscard]] bool take_refused_release();

  /// The only partition of the writer of a sample, i.e. the operator that its permissions name;
  /// empty: none, several, a pattern, or the writer is gone and had not been discovered.
  [[nodiscard]] std::string partition_of(const Commands& samples, std::size_t i) const;
  [[nodiscard]] std::string partition_of(const Stops& samples, std::size_t i);

  /// As read at the start; empty: unsecured.
  [[nodiscard]] const std::optional<dds::Identity>& identity() const { return identity_; }
  [[nodiscard]] std::int64_t write_failures() const { return write_failures_; }

 private:
  explicit DdsLink(const std::string& vehicle) : admission_(vehicle) {}
  static bool admits(const void* sample, const dds_sample_info_t* info, void* link);
  void update_writers();

  std::optional<dds::Identity> identity_;
  std::mutex mutex_;  // of admission_, which a thread of DDS calls; outlives the entities below
  StopAdmission admission_;
  std::uint32_t writers_changed_ = 0;

  // In order of creation; released in reverse order.
  dds::Entity domain_;
  dds::Entity participant_;
  dds::Entity state_writer_;
  dds::Entity status_writer_;
  dds::Entity command_reader_;
  dds::Entity stop_reader_;
  std::int64_t write_failures_ = 0;
};

}  // namespace rcs::gateway
