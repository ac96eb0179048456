#pragma once
// A scenario as a source of messages: those of the sensors and the ground truth, by arrival.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "lcmtypes/rcs/drive_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/actors/actor.h"
#include "sim/actors/actor_contact.h"
#include "sim/scenario.h"
#include "sim/vehicle/commanded_vehicle.h"
#include "sim/vehicle/contact.h"

namespace rcs::sim {

/// Deterministic for a scenario and the drive commands with their arrivals: the events are
/// identical to the byte. A message arrives at the end of its measurement plus the transport delay:
/// a LADAR facet after its last shot.
class Simulator final : public EventSource {
 public:
  /// Time 0 of the simulation on the timeline and in stamps.
  static constexpr Stamp kStart = Stamp(std::chrono::seconds(1000));

  explicit Simulator(const Scenario& scenario);

  /// Ids of every message; the id of the run depends on the scenario with its seed.
  [[nodiscard]] const Publisher& publisher() const { return publisher_; }

  [[nodiscard]] Stamp peek() override;
  void take(SourceEvent* event) override;

  /// Whether drive commands move the vehicle. It stands until one is received and brakes when they
  /// end.
  [[nodiscard]] bool commanded() const { return commanded_.has_value(); }
  /// Receives drive commands from a bus that outlives it; commanded() only. They have one publisher
  /// (ChannelOwner), and an emergency stop is released by the run that has set it.
  /// @param shift  time of the bus minus that of the simulation: live, the two have different
  ///   origins
  void listen(Bus* bus, Duration shift);
  /// Drive commands of the bus that were not those of the one publisher so far.
  [[nodiscard]] std::int64_t rejected_commands() const;
  /// A drive command that arrives now; both in simulation time. commanded() only.
  void command(const drive_t& message, Stamp arrival);
  /// Null when not commanded().
  [[nodiscard]] const CommandedVehicle* commanded_vehicle() const {
    return commanded_ ? &*commanded_ : nullptr;
  }

  /// Time of the end of the drive.
  [[nodiscard]] Stamp end() const { return kStart + from_seconds(duration_s_); }
  [[nodiscard]] const World& world() const { return world_; }
  /// Motion of the vehicle; of a commanded one up to slightly after the last event.
  [[nodiscard]] const Trajectory& vehicle() const {
    return commanded_ ? commanded_->motion() : *scripted_;
  }
  /// Horizontal distance driven so far.
  [[nodiscard]] double driven_m() const { return driven_m_; }
  /// With the ground, of a commanded vehicle so far, each counted when it begins; see
  /// sim/vehicle/contact.h.
  struct Contacts {
    int edge = 0;
    int body = 0;
    int tipped = 0;
    [[nodiscard]] int total() const { return edge + body + tipped; }
  };
  [[nodiscard]] const Contacts& contacts() const { return contacts_; }
  [[nodiscard]] const Actors& actors() const { return actors_; }
  /// Of a commanded vehicle with them.
  [[nodiscard]] const ActorContacts& actor_contacts() const { return actor_contacts_; }
  [[nodiscard]] const Course& course() const { return course_; }
  /// The a priori map of the scenario's course.
  /// @param cell_m  [0.2, 100] instead of that of the scenario; 0: that of the scenario
  [[nodiscard]] PriorMap prior_map(double cell_m = 0.0) const;

 private:
  // Order of events with equal arrival.
  enum Sensor : std::size_t { kIns, kOdometry, kGps, kLadar, kTruth, kSensors };
  struct Schedule {
    Stamp due = Stamp::max();
    std::int64_t count = 0;  // messages or intervals so far
    std::int64_t seq = 0;
  };

  void receive_commands();
  void command(const drive_t& m, Stamp arrival, Duration shift);
  void emit_ins(SourceEvent* event);
  void emit_odometry(SourceEvent* event);
  void emit_gps(SourceEvent* event);
  void emit_ranges(SourceEvent* event);
  void emit_points(SourceEvent* event);
  void emit_truth(SourceEvent* event);
  void count_contacts(const Motion& motion, double time_s);
  void schedule_periodic(Sensor sensor, double interval_s, Duration delay);
  void schedule_gps();
  void schedule_ladar();
  [[nodiscard]] Duration facet_start(std::int64_t facet) const;
  [[nodiscard]] int facets() const;

  Scenario scenario_;
  Publisher publisher_;
  Course course_;
  World world_;
  Actors actors_;
  double duration_s_;
  std::optional<Trajectory> scripted_;  // one of scripted_ and commanded_ is set
  std::optional<CommandedVehicle> commanded_;
  std::optional<Inbox<drive_t>> commands_;
  std::optional<Publisher> stopped_by_;  // of the newest command, if it is an emergency stop
  std::int64_t releases_refused_ = 0;    // because another run has stopped the vehicle
  Duration bus_shift_{};
  InertialSensor ins_;
  WheelOdometer odometer_;
  GpsReceiver gps_;
  RangeImager imager_;
  SpinningLadar spinning_;
  std::array<Schedule, kSensors> schedule_;
  std::int64_t fixes_ = 0;  // fixes whose noise has been drawn
  double driven_m_ = 0.0;
  Vec2 last_place_world_;
  Contacts contacts_;
  Contact touching_;
  ActorContacts actor_contacts_;
  RangeFacet facet_;
  PointSector sector_;
};

/// Runs a scenario into a log as fast as possible.
/// @param progress  called repeatedly with the finished share, [0, 1]
[[nodiscard]] Outcome simulate_to_log(const Scenario& scenario, LogWriter* log,
                                      const std::function<void(double)>& progress);

}  // namespace rcs::sim
