#pragma once
// Detects steps of the sensor clocks from the advance of stamps and arrivals. The two are never
// subtracted from each other (ADR 1), only their advances are compared: a stamp cannot gain on its
// arrival unless a clock has stepped, and a clock that has stepped back repeats its time.

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "modules/wm/eskf.h"
#include "rcs/base/stamp_lead.h"

namespace rcs::wm {

/// The sources whose clocks are compared with the clock of the INS.
enum class Clock : int { kOdometry = 0, kGps = 1, kLadar = 2 };
constexpr std::size_t kClocks = 3;

struct ClockStep {
  Duration step{};     ///< change of the stamps; negative: backward
  bool of_all = true;  ///< of all sources; false: of the INS alone
};

class ClockWatch {
 public:
  ClockWatch() { held_.reserve(kMaxHeld); }

  enum class Verdict {
    kPass,
    kHeld,     ///< waits until the suspected step is resolved: see resolve()
    kRepeated  ///< a copy of one of the newest samples: to be dropped
  };
  /// @param imu  with its stamp as received
  Verdict add(const ImuSample& imu, Stamp arrival);

  /// Any other input. False: it must be dropped, because its clock may have stepped, too, or has
  /// just done so. Also of messages whose contents are not used.
  bool add(Clock clock, Stamp stamp, Stamp arrival);
  /// Continues with the shift of another watch. Before any input.
  void resume(Duration ins_shift) { ins_shift_ = ins_shift; }

  /// @return the step, once it is confirmed; held() then returns the samples since. If no other
  ///   source could tell whose clocks have stepped, that of all is presumed; the next ones may show
  ///   that it was the INS alone: the opposite step then returns all of them
  [[nodiscard]] std::optional<ClockStep> resolve(Stamp now);
  /// Samples that were held and are due, in the order of their arrival; at most kMaxHeld.
  [[nodiscard]] const std::vector<ImuSample>& held() const { return held_; }
  void clear_held() { held_.clear(); }
  /// Whether held samples were dropped for wrong stamps since the last call.
  [[nodiscard]] bool take_dropped() { return std::exchange(dropped_, false); }
  /// Shift to add to the stamps of the INS so that they agree with the clock of the other sources.
  [[nodiscard]] Duration ins_shift() const { return ins_shift_; }
  /// A step is suspected and samples of the INS are held.
  [[nodiscard]] bool suspects() const { return suspected_; }

 private:
  static constexpr std::size_t kMaxHeld = 512;
  static constexpr Duration kForward = from_milliseconds(30.0);  ///< gain of a stamp on its arrival
  static constexpr Duration kBackward = from_milliseconds(40.0);  ///< repeated time
  static constexpr Duration kPatience = from_milliseconds(350.0);
  static constexpr Duration kSettling = from_milliseconds(300.0);
  static constexpr int kKnown = 20;  ///< messages after which the latency of a source is known

  /// Of the stamps of one source over their arrivals.
  struct Track : StampLead {
    Duration since_drift{};  ///< for which `best` has not been lowered yet
    bool judges = false;     ///< its latency was known when a step was presumed

    /// @param follows  `best` may grow
    void add(Stamp s, Stamp arrival, bool follows);
    [[nodiscard]] bool known() const { return count > kKnown; }
    [[nodiscard]] bool alive(Stamp now) const;
    /// Its newest stamp has changed as by this step.
    [[nodiscard]] bool moved_by(Duration step) const;
  };
  /// The newest samples of the INS.
  class Recent {
   public:
    void add(const ImuSample& imu);
    /// With the same stamp and increments; false where all have the same, without noise.
    [[nodiscard]] bool has(const ImuSample& imu) const;
    /// No stamp is within this time of it, and some are older: a sample that was overtaken. A clock
    /// that has stepped back repeats its time.
    [[nodiscard]] bool lacks(Stamp stamp, Duration within) const;

   private:
    std::array<ImuSample, 64> samples_{};
    std::size_t count_ = 0;
  };
  [[nodiscard]] std::optional<bool> has_stepped(Clock clock, Stamp now) const;
  [[nodiscard]] bool established() const;
  void settle(const ClockStep& step, Stamp now);
  void check_presumed(const Track& track);
  ClockStep take_back();

  Track ins_;
  Recent recent_;
  std::array<Track, kClocks> others_;
  std::vector<ImuSample> held_;
  bool suspected_ = false;
  bool dropped_ = false;
  Stamp disorder_ = Stamp::min();  ///< newest stamp of a suspected backward step that was disorder
  Duration step_{};                ///< suspected step
  Stamp suspected_at_{};           ///< arrival of the suspected sample
  Stamp last_held_arrival_{};
  Stamp unsettled_until_ =
      Stamp::min();  ///< inputs of the other sources are dropped until this arrival
  Duration ins_shift_{};
  Duration presumed_{};  ///< step of all clocks that no other source has confirmed; 0: none
  int for_ = 0;          ///< messages in a row that have stepped by it
  int against_ = 0;      ///< and that have not
};

}  // namespace rcs::wm
