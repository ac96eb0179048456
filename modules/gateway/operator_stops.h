#pragma once
// The emergency stops of the operators in the latch of BG. Each operator has one, with its name, so
// that a release by another operator does not end it, also after a restart of this process. Pure.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::gateway {

class OperatorStops {
 public:
  struct Stop {
    std::string operator_id;  ///< empty: of unknown operators
    std::int64_t number = 0;  ///< Command::stop; 0: set by a former process of the gateway
  };

  /// A former process has set it: BG lists it already, and one of this process is sent only if it
  /// has been sent before.
  void adopt(std::string_view operator_id);
  /// An operator stops, or stops again.
  void press(std::string_view operator_id, Stamp now);

  using IsListed = std::function<bool(const Stop&)>;
  /// Once a cycle.
  /// @param engaged  operators whose stops are in force; empty name: unknown ones
  /// @param is_listed  by BG
  /// @param refresh  a stop in force is to be sent again
  /// @return the stop to be sent now
  std::optional<Stop> update(const std::vector<std::string_view>& engaged, Stamp now,
                             const IsListed& is_listed, bool refresh);
  /// Operators of former processes whose stop was released by an authority since the last call.
  [[nodiscard]] std::vector<std::string> take_ended() { return std::exchange(ended_, {}); }

 private:
  /// A stop that arrives while an authority releases those before it is another one, although BG
  /// still lists the former one of this operator.
  static constexpr Duration kAgain = from_seconds(3.0);

  struct Entry {
    Stop stop;
    Stamp pressed = Stamp::min();
    bool listed = false;  ///< was listed once
    bool sent = false;
  };
  [[nodiscard]] Entry* find(std::string_view operator_id);

  std::vector<Entry> entries_;
  std::vector<std::string> ended_;
  std::int64_t newest_ = 0;
};

}  // namespace rcs::gateway
