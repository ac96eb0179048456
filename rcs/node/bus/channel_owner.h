#pragma once
// The publisher of a channel that a node receives. Each channel has one: of two, the values would
// jump from one to the other. Pure: the same messages give the same owner.

#include <cstdint>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/node/bus/publisher.h"

namespace rcs {

class ChannelOwner {
 public:
  enum class Rule {
    kAnyone,      ///< commands, and channels that are not of this system
    kRun,         ///< statistics: any process of the run
    kOne,         ///< sensors: one publisher, of any run; a driver, the simulator or a log player
    kOneOfTheRun  ///< outputs of nodes
  };
  enum class Verdict {
    kAccepted,
    kOtherRun,  ///< of another run, as a recording that is played
    kSecond     ///< the owner still publishes
  };

  ChannelOwner() = default;
  /// @param run_id  of the listener
  ChannelOwner(Rule rule, std::int64_t run_id) : rule_(rule), run_id_(run_id) {}

  /// A publisher whose messages came between those of the owner is a second one, not a successor.
  static constexpr Duration kContested = from_seconds(3.0);

  /// Another publisher becomes the owner after the present one has been silent for 2.5 of its
  /// intervals; if both published within the last 3 s, only after 3 s of silence.
  [[nodiscard]] Verdict judge(const Publisher& from, Stamp arrival);
  /// A valid message of an accepted publisher.
  /// @return the publisher has changed
  bool accept(const Publisher& from, Stamp arrival);

  /// One publisher at a time, so that a change of it is an event.
  [[nodiscard]] bool exclusive() const {
    return rule_ == Rule::kOne || rule_ == Rule::kOneOfTheRun;
  }
  /// A message was accepted.
  [[nodiscard]] bool known() const { return received_ != Stamp::min(); }
  [[nodiscard]] const Publisher& owner() const { return owner_; }
  [[nodiscard]] bool is(const Publisher& from) const {
    return known() && from.run_id == owner_.run_id && from.publisher_id == owner_.publisher_id;
  }

 private:
  [[nodiscard]] bool may_follow(Stamp arrival) const;
  [[nodiscard]] Duration silence() const;

  Rule rule_ = Rule::kAnyone;
  std::int64_t run_id_ = 0;
  Publisher owner_;
  Stamp received_ = Stamp::min();   ///< the owner's newest message; min: no owner yet
  Duration interval_{};             ///< between its messages, low-passed; zero: unknown
  bool second_waits_ = false;       ///< a message was rejected since the owner's newest one
  Stamp contested_ = Stamp::min();  ///< the owner's newest message after a rejected one
};

/// The rule for a channel of lcmtypes/channels.h.
[[nodiscard]] ChannelOwner::Rule ownership_of(std::string_view channel);

}  // namespace rcs
