#pragma once
// Detects steps of the sensors' clocks by how stamps and arrivals advance. The two are never
// subtracted from each other (DECISIONS 1), only what each has advanced by: a stamp cannot gain on
// its arrival unless a clock has stepped, and a clock that has stepped back repeats its time.

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "modules/wm/eskf.h"

namespace rcs::wm {

/// The sources whose clocks are compared with that of the INS.
enum class Clock : int { kOdometry = 0, kGps = 1, kLadar = 2 };
constexpr std::size_t kClocks = 3;

struct ClockStep {
  Duration step{};     ///< of the stamps; negative: backward
  bool of_all = true;  ///< of all sources; false: of the INS alone
};

class ClockWatch {
 public:
  ClockWatch() { held_.reserve(kMaxHeld); }

  enum class Verdict {
    kPass,
    kHeld  ///< waits until it is known what has stepped: see resolve()
  };
  /// @param imu  with the stamp as it was received
  Verdict add(const ImuSample& imu, Stamp arrival);

  /// Any other input. False: it must be dropped, because its stamp may be of the clock from before
  /// a step.
  bool add(Clock clock, Stamp stamp, Stamp arrival);

  /// @return the step, once it is known; take_held() then has the samples since
  [[nodiscard]] std::optional<ClockStep> resolve(Stamp now);
  /// Samples that were held and are due, in the order of their arrival, at most kMaxHeld.
  [[nodiscard]] const std::vector<ImuSample>& held() const { return held_; }
  void clear_held() { held_.clear(); }
  /// Held samples were dropped, as their stamps were wrong, since the last call.
  [[nodiscard]] bool take_dropped() { return std::exchange(dropped_, false); }
  /// What to add to the stamps of the INS so that they are of the other sources' clock.
  [[nodiscard]] Duration ins_shift() const { return ins_shift_; }
  /// A step is suspected and the INS is held.
  [[nodiscard]] bool suspects() const { return suspected_; }

 private:
  static constexpr std::size_t kMaxHeld = 512;
  static constexpr Duration kForward = from_milliseconds(30.0);   ///< of a stamp on its arrival
  static constexpr Duration kBackward = from_milliseconds(40.0);  ///< of repeated time
  static constexpr Duration kPatience = from_milliseconds(350.0);
  static constexpr Duration kSettling = from_milliseconds(300.0);
  static constexpr int kKnown = 20;  ///< messages after which a source's latency is known

  /// How the stamps of one source have advanced against its arrivals since its first message.
  struct Track {
    Stamp stamp = Stamp::min();
    Stamp arrival = Stamp::min();
    Duration lead{};  ///< of the newest message
    Duration best{};  ///< largest lead: that of the least latency
    int count = 0;

    void add(Stamp s, Stamp a);
    [[nodiscard]] bool alive(Stamp now) const;
  };
  [[nodiscard]] std::optional<bool> has_stepped(Clock clock, Stamp now) const;
  [[nodiscard]] bool established() const;
  void settle(const ClockStep& step, Stamp now);

  Track ins_;
  std::array<Track, kClocks> others_;
  std::vector<ImuSample> held_;
  bool suspected_ = false;
  bool dropped_ = false;
  Stamp disorder_ =
      Stamp::min();       ///< newest stamp that was suspected of a step backward without being one
  Duration step_{};       ///< suspected
  Stamp suspected_at_{};  ///< arrival
  Stamp last_held_arrival_{};
  Stamp unsettled_until_ = Stamp::min();  ///< arrival
  Duration ins_shift_{};
};

}  // namespace rcs::wm
