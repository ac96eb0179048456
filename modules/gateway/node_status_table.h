#pragma once
// Status of the nodes of the vehicle: content, age, and when to publish it.

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

struct NodeStatusParams {
  Duration period = from_seconds(1.0);  ///< of the status of a node that does not change
  Duration settle =
      from_milliseconds(100.0);  ///< shortest interval between two, even if the status alternates
  Duration silence = from_seconds(2.5);  ///< after a longer silence a node is not alive
};

class NodeStatusTable {
 public:
  NodeStatusTable(const std::vector<std::string>& names, const NodeStatusParams& params);

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] std::string_view name(std::size_t i) const { return rows_[i].name; }

  /// Node i was received; its content goes into facts(i).
  void receive(std::size_t i, Stamp now);
  [[nodiscard]] NodeFacts& facts(std::size_t i) { return rows_[i].facts; }
  [[nodiscard]] const NodeFacts& facts(std::size_t i) const { return rows_[i].facts; }

  /// Time since node i was received; -1 us: never.
  [[nodiscard]] Duration age(std::size_t i, Stamp now) const;
  [[nodiscard]] bool alive(std::size_t i, Stamp now) const;

  /// Whether the status of node i is due: it has changed (counters do not count), or the period is
  /// over. True once, because it then counts as published.
  [[nodiscard]] bool take_due(std::size_t i, Stamp now);

 private:
  struct Row {
    std::string name;
    NodeFacts facts;
    bool received = false;
    Stamp received_at;
    // As last published.
    bool told = false;
    Stamp told_at;
    bool told_alive = false;
    std::int8_t told_level = 0;
    std::string told_state;
    std::string told_reason;
  };

  NodeStatusParams params_;
  std::vector<Row> rows_;
};

}  // namespace rcs::gateway
