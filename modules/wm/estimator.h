#pragma once
// The whole of WM's estimation without its message shell: start-up, history, recovery.

#include <optional>
#include <vector>

#include "modules/wm/alignment.h"
#include "modules/wm/clock_watch.h"
#include "modules/wm/fault_detection.h"
#include "modules/wm/history.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {

/// A fix as the receiver gives it.
struct GeodeticFix {
  Geodetic antenna;
  GpsFix fix;  ///< p_world is computed from `antenna`
};

/// Runs from whatever exists. Without a datum or before the heading is known, the world is a frame
/// of the filter's own: level, its origin and heading those of the vehicle at the start.
class Estimator {
 public:
  explicit Estimator(const WmParams& params, const std::optional<Geodetic>& datum);

  // Inputs, in any order of sources and (within the history's lag) of stamps.
  /// @param arrival  node time at which it was received: a step of the clocks is told from a
  ///   silence by what the arrivals have advanced by; min(): not known, no clock is watched
  Reason add(const ImuSample& imu, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const GeodeticFix& fix, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const RollingMatch& match, Stamp arrival = Stamp::min());
  /// A match that comes while nothing absolute is known is where the world begins, if the datum is
  /// configured: SP has searched for it.
  Reason add(Stamp stamp, const PriorMatch& match, Stamp arrival = Stamp::min());
  Reason add(Stamp stamp, const OdometrySample& odometry, Stamp arrival = Stamp::min());

  /// To be called each cycle before fuse(): settles what clocks are suspected of.
  void watch_clocks(Stamp now);

  /// Takes in all inputs that were added.
  void fuse();

  /// False while it aligns: there is no state yet.
  [[nodiscard]] bool started() const { return started_; }
  /// The newest; read it when started().
  [[nodiscard]] const FilterState& state() const { return history_.head(); }
  [[nodiscard]] Mode mode() const;
  /// The smooth pose: the belief's own motion from call to call, which late data cannot change any
  /// more, pulled towards Memory::T_local_vehicle at a bounded rate. GPS and the a priori map do
  /// not move it.
  [[nodiscard]] const Pose& T_local_vehicle() const { return T_local_vehicle_; }
  /// Origin of the world once the belief is anchored to it.
  [[nodiscard]] const std::optional<LocalFrame>& datum() const { return datum_; }
  /// What is believed of the sources, a history's lag late.
  [[nodiscard]] const Trust& trust() const { return trust_; }
  /// Times that all clocks were found to have stepped.
  [[nodiscard]] int clock_steps() const { return clock_steps_; }
  /// The newest step by which the clock of the INS alone differs from the others' now.
  [[nodiscard]] Duration ins_clock_shift() const { return clocks_.ins_shift(); }

  /// Records since the last call to clear_innovations().
  [[nodiscard]] const std::vector<Innovation>& innovations() const { return innovations_; }
  void clear_innovations() { innovations_.clear(); }

 private:
  struct WaitingFix {
    Stamp stamp{};
    GpsFix fix;
  };
  Reason add(const Measurement& m);
  Reason add_inertial(ImuSample imu);
  Reason add_held();
  void start(const Belief& belief, double gravity);
  void finish();
  void find_heading();
  void find_place();
  void step_clock(Stamp to);
  void move_clock(Duration step);
  void begin_anew(Stamp to);
  void restart(const FilterState& state);
  void forget_place(FilterState* state) const;
  void move_local();

  WmParams params_;
  std::optional<LocalFrame> datum_;
  History history_;
  Trust trust_;
  Leveler leveler_;
  HeadingFinder heading_;
  ClockWatch clocks_;
  std::vector<WaitingFix> waiting_;  ///< for the heading, of which the state is not fused yet
  struct WaitingMatch {
    Stamp stamp{};
    PriorMatch match;
  };
  std::optional<WaitingMatch> waiting_match_;  ///< for the state of its instant
  std::vector<Innovation> innovations_;
  bool started_ = false;
  Pose T_local_vehicle_;
  Stamp local_stamp_ = Stamp::min();
  double slew_s_ = 0.0;  ///< of slewing that is allowed now
  Stamp newest_imu_ = Stamp::min();
  int out_of_range_ = 0;  ///< inputs refused for their stamps since one was taken
  Stamp first_out_of_range_ = Stamp::min();
  int clock_steps_ = 0;
};

}  // namespace rcs::wm
