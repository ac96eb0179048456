#pragma once
// The estimation of WM without its message shell: start, history, recovery.

#include <optional>
#include <vector>

#include "modules/wm/alignment.h"
#include "modules/wm/clock_watch.h"
#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/history.h"
#include "modules/wm/loss_watch.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {

/// A fix as received, in geodetic coordinates.
struct GeodeticFix {
  Geodetic antenna;
  GpsFix fix;  ///< p_world is computed from `antenna`
};

/// What another estimator with the same parameters continues with. Copied as bytes.
struct Continuation {
  FilterState state;
  Pose T_local_vehicle;
  Earth earth;
  bool has_datum = false;
  Geodetic datum;
  Duration ins_clock_shift{};
};

/// Runs on the inputs that exist. Without a datum, or before the heading is known, frame world is a
/// level frame of the filter, with the origin and heading of the vehicle at the start.
class Estimator {
 public:
  explicit Estimator(const WmParams& params, const std::optional<Geodetic>& datum);

  // Inputs, in any order of sources and, within the lag of the history, of stamps.
  /// @param arrival  node time at which it was received: the advance of the arrivals distinguishes
  ///   a clock step from a silence; min(): unknown, no clock is monitored
  Reason add(const ImuSample& imu, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const GeodeticFix& fix, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const RollingMatch& match, Stamp arrival = Stamp::min());
  /// Before the world is georeferenced, and if the datum is configured, a match initializes the
  /// pose in frame world: it comes from the initial localization of SP.
  Reason add(Stamp stamp, const PriorMatch& match, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const OdometrySample& odometry, Stamp arrival = Stamp::min());

  /// The samples of the INS in [since, until) were wrong: as if they had not been received.
  /// @param since, until  as stamped by the INS
  void discard_ins(Stamp since, Stamp until);

  /// Of the newest state; valid when started().
  [[nodiscard]] Continuation continuation() const;
  /// Continues where another estimator ended. The time since then is a silence of all inputs.
  /// Before any input.
  void resume(const Continuation& from);

  /// To be called in each cycle before fuse(): resolves suspected clock steps.
  void watch_clocks(Stamp now);
  /// A message whose contents are not used still shows the clock of its source.
  void watch_clock(Clock clock, Stamp stamp, Stamp arrival) {
    static_cast<void>(clocks_.add(clock, stamp, arrival));
  }

  /// Fuses all inputs that were added.
  void fuse();

  /// False during the alignment: there is no state yet.
  [[nodiscard]] bool started() const { return started_; }
  /// The newest state; valid when started().
  [[nodiscard]] const FilterState& state() const { return history_.head(); }
  [[nodiscard]] Mode mode() const;
  /// The smooth pose: the motion of the belief from call to call, which late data no longer
  /// changes, moved towards Bookkeeping::T_local_vehicle at a bounded rate. GPS and the a priori
  /// map do not move it.
  [[nodiscard]] const Pose& T_local_vehicle() const { return T_local_vehicle_; }
  /// Origin of frame world once the belief is georeferenced.
  [[nodiscard]] const std::optional<LocalFrame>& datum() const { return datum_; }
  /// Source status, delayed by the lag of the history.
  [[nodiscard]] const FaultDetection& fault_detection() const { return fault_detection_; }
  /// Silences of all inputs, too long to predict, after which no rolling map that continued has
  /// placed the vehicle: frame local does not continue over them.
  [[nodiscard]] int local_breaks() const { return local_breaks_; }
  /// Number of steps of all clocks that were detected.
  [[nodiscard]] int clock_steps() const { return clock_steps_; }
  /// Number of times that the solution was lost and began again.
  [[nodiscard]] int losses() const { return losses_; }
  /// Newest step of the clock of the INS alone against the other clocks.
  [[nodiscard]] Duration ins_clock_shift() const { return clocks_.ins_shift(); }

  /// Innovation records since the last call of clear_innovations().
  [[nodiscard]] const std::vector<Innovation>& innovations() const { return innovations_; }
  void clear_innovations() { innovations_.clear(); }

 private:
  struct WaitingFix {
    Stamp stamp{};
    GpsFix fix;
  };
  /// @param arrival  min(): unknown
  Reason add(const Measurement& m, Stamp arrival);
  Reason add_inertial(ImuSample imu, Stamp arrival);
  Reason add_held();
  void start(const Belief& belief, double gravity);
  void finish();
  void find_heading();
  void find_place();
  void step_clock(Stamp to);
  void move_clock(Duration step);
  void begin_after_silence(Stamp to);
  [[nodiscard]] static bool stands_in_map(const Belief& b);
  static void forget_all_but_map(Stamp to, FilterState* state);
  void place_in_rolling_map(Stamp stamp, const RollingMatch& match);
  void restart(const FilterState& state);
  void forget_place(FilterState* state) const;
  void watch_loss();
  void move_local();

  WmParams params_;
  std::optional<LocalFrame> datum_;
  History history_;
  FaultDetection fault_detection_;
  Leveler leveler_;
  HeadingFinder heading_;
  ClockWatch clocks_;
  std::vector<WaitingFix>
      waiting_;  ///< fixes for the heading search, until the state of their instant is fused
  struct WaitingMatch {
    Stamp stamp{};
    PriorMatch match;
  };
  std::optional<WaitingMatch> waiting_match_;  ///< until the state of its instant is fused
  std::vector<Innovation> innovations_;
  bool started_ = false;
  Pose T_local_vehicle_;
  Stamp local_stamp_ = Stamp::min();
  double slew_s_ = 0.0;  ///< time for which slewing is allowed now
  Stamp newest_imu_ = Stamp::min();
  int out_of_range_ = 0;  ///< inputs in a row rejected for their stamps
  Stamp first_out_of_range_ = Stamp::min();
  Stamp in_range_arrival_ = Stamp::min();  ///< newest arrival of an input that was in range
  int clock_steps_ = 0;
  int local_breaks_ = 0;
  LossWatch loss_;
  int losses_ = 0;
  /// When all inputs fell silent for so long that the place was forgotten.
  struct BeforeSilence {
    FilterState state;
    Pose T_local_vehicle;
    Stamp end;                       ///< of the silence
    std::int64_t registrations = 0;  ///< that SP has published since it began
  };
  std::optional<BeforeSilence> before_silence_;
  Stamp silence_began_ = Stamp::min();  ///< newest silence of all inputs
  Stamp silence_ended_ = Stamp::min();
};

}  // namespace rcs::wm
