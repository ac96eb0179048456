#include "modules/gateway/node_status_table.h"

namespace rcs::gateway {

NodeStatusTable::NodeStatusTable(const std::vector<std::string>& names,
                                 const NodeStatusParams& params)
    : params_(params), rows_(names.size()) {
  for (std::size_t i = 0; i < names.size(); ++i) rows_[i].name = names[i];
}

void NodeStatusTable::receive(std::size_t i, Stamp now) {
  rows_[i].received = true;
  rows_[i].received_at = now;
}

Duration NodeStatusTable::age(std::size_t i, Stamp now) const {
  return rows_[i].received ? now - rows_[i].received_at : Duration(-1);
}

bool NodeStatusTable::alive(std::size_t i, Stamp now) const {
  return rows_[i].received && now - rows_[i].received_at <= params_.silence;
}

bool NodeStatusTable::take_due(std::size_t i, Stamp now) {
  Row& row = rows_[i];
  const bool is_alive = alive(i, now);
  if (row.told) {
    const bool changed = is_alive != row.told_alive || row.facts.degrade_level != row.told_level ||
                         row.facts.state != row.told_state || row.facts.reason != row.told_reason;
    if (now - row.told_at < (changed ? params_.settle : params_.period)) return false;
  }
  row.told = true;
  row.told_at = now;
  row.told_alive = is_alive;
  row.told_level = row.facts.degrade_level;
  row.told_state = row.facts.state;
  row.told_reason = row.facts.reason;
  return true;
}

}  // namespace rcs::gateway
