#pragma once
// A scenario as a source of messages: the sensors' and the truth's, in the order of arrival.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "lcmtypes/rcs/drive_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/scenario.h"
#include "sim/vehicle/commanded_vehicle.h"

namespace rcs::sim {

/// Deterministic for a scenario, and for what a commanded vehicle hears when: the same events to
/// the byte. A message arrives when what it measures is over, plus its way: a LADAR facet after its
/// last shot.
class Simulator final : public EventSource {
 public:
  /// Simulation time 0 on the timeline and in stamps.
  static constexpr Stamp kStart = Stamp(std::chrono::seconds(1000));

  explicit Simulator(const Scenario& scenario);

  /// Its ids in every message: the run's is of the scenario with its seed.
  [[nodiscard]] const Publisher& publisher() const { return publisher_; }

  [[nodiscard]] Stamp peek() override;
  void take(SourceEvent* event) override;

  /// Whether drive commands move the vehicle. It stands until one comes, and brakes when they end.
  [[nodiscard]] bool commanded() const { return commanded_.has_value(); }
  /// Takes drive commands from a bus that outlives it; commanded() only.
  /// @param shift  time of the bus minus the simulation's: live, the two begin differently
  void listen(Bus* bus, Duration shift);
  /// A drive command that arrives now; both in the simulation's time. commanded() only.
  void command(const drive_t& message, Stamp arrival);
  /// Null when not commanded().
  [[nodiscard]] const CommandedVehicle* commanded_vehicle() const {
    return commanded_ ? &*commanded_ : nullptr;
  }

  /// Last moment of the drive.
  [[nodiscard]] Stamp end() const { return kStart + from_seconds(duration_s_); }
  [[nodiscard]] const World& world() const { return world_; }
  /// How the vehicle moves; a commanded one: moved, up to the last event and a little beyond.
  [[nodiscard]] const Trajectory& vehicle() const {
    return commanded_ ? commanded_->motion() : *scripted_;
  }
  /// So far, seen from above.
  [[nodiscard]] double driven_m() const { return driven_m_; }
  [[nodiscard]] const Course& course() const { return course_; }
  /// The a priori map of the scenario's course.
  /// @param cell_m  [0.2, 100] instead of the scenario's; 0: as that says
  [[nodiscard]] PriorMap prior_map(double cell_m = 0.0) const;

 private:
  // Ties of arrival go in this order.
  enum Sensor : std::size_t { kIns, kOdometry, kGps, kLadar, kTruth, kSensors };
  struct Schedule {
    Stamp due = Stamp::max();
    std::int64_t count = 0;  // messages or intervals so far
    std::int64_t seq = 0;
  };

  void hear_commands();
  void command(const drive_t& m, Stamp arrival, Duration shift);
  void emit_ins(SourceEvent* event);
  void emit_odometry(SourceEvent* event);
  void emit_gps(SourceEvent* event);
  void emit_ranges(SourceEvent* event);
  void emit_points(SourceEvent* event);
  void emit_truth(SourceEvent* event);
  void schedule_periodic(Sensor sensor, double interval_s, Duration delay);
  void schedule_gps();
  void schedule_ladar();
  [[nodiscard]] Duration facet_start(std::int64_t facet) const;
  [[nodiscard]] int facets() const;

  Scenario scenario_;
  Publisher publisher_;
  Course course_;
  World world_;
  double duration_s_;
  std::optional<Trajectory> scripted_;  // one of the two
  std::optional<CommandedVehicle> commanded_;
  std::optional<Inbox<drive_t>> commands_;
  Duration bus_shift_{};
  InertialSensor ins_;
  WheelOdometer odometer_;
  GpsReceiver gps_;
  RangeImager imager_;
  SpinningLadar spinning_;
  std::array<Schedule, kSensors> schedule_;
  std::int64_t fixes_ = 0;  // moments of fixes whose noise has been drawn
  double driven_m_ = 0.0;
  Vec2 last_place_world_;
  RangeFacet facet_;
  PointSector sector_;
};

/// Runs a scenario into a log as fast as it goes.
/// @param progress  called now and then with the share that is done, [0, 1]
[[nodiscard]] Outcome simulate_to_log(const Scenario& scenario, LogWriter* log,
                                      const std::function<void(double)>& progress);

}  // namespace rcs::sim
