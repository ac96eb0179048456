#pragma once
// What is known of the vehicle's nodes, how old it is, and when to tell it.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::gateway {

struct NodeFacts {
  std::int8_t degrade_level = 0;
  std::int64_t cycles = 0;  ///< so far, as are missed and overruns
  std::int64_t missed = 0;
  std::int64_t overruns = 0;
  std::string state;
  std::string reason;
};

struct BoardParams {
  Duration period = from_seconds(1.0);         ///< between two lines of a node that does not change
  Duration settle = from_milliseconds(100.0);  ///< at least this between two, even if it flickers
  Duration silence = from_seconds(2.5);        ///< a node that says nothing for longer is not alive
};

class NodeBoard {
 public:
  NodeBoard(const std::vector<std::string>& names, const BoardParams& params);

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] std::string_view name(std::size_t i) const { return rows_[i].name; }

  /// Something came from node i; what it said goes into facts(i).
  void hear(std::size_t i, Stamp now);
  [[nodiscard]] NodeFacts& facts(std::size_t i) { return rows_[i].facts; }
  [[nodiscard]] const NodeFacts& facts(std::size_t i) const { return rows_[i].facts; }

  /// Since node i was heard; -1 us: never.
  [[nodiscard]] Duration age(std::size_t i, Stamp now) const;
  [[nodiscard]] bool alive(std::size_t i, Stamp now) const;

  /// Whether node i's line is to be told now: it has changed (counters alone are no change), or the
  /// period is over. True once, as the line counts as told then.
  [[nodiscard]] bool take_due(std::size_t i, Stamp now);

 private:
  struct Row {
    std::string name;
    NodeFacts facts;
    bool heard = false;
    Stamp heard_at;
    // As told last.
    bool told = false;
    Stamp told_at;
    bool told_alive = false;
    std::int8_t told_level = 0;
    std::string told_state;
    std::string told_reason;
  };

  BoardParams params_;
  std::vector<Row> rows_;
};

}  // namespace rcs::gateway
