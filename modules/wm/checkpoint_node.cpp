#include "modules/wm/checkpoint_node.h"

#include <type_traits>

namespace rcs::wm {
namespace {

/// All rows of 512 in a second.
constexpr std::size_t kRowsPerCycle = 10;

}  // namespace

CheckpointLayout CheckpointKeeper::layout(const TerrainGrid& grid) {
  static_assert(std::is_trivially_destructible_v<State>, "copied as bytes");
  return {sizeof(State), grid.rows(), grid.row_bytes()};
}

CheckpointKeeper::Result CheckpointKeeper::resume(Stamp now, Estimator* estimator,
                                                  TerrainDesk* terrain, NodeState* node) {
  row_.resize(terrain->grid().row_bytes());
  if (!memory_->read_state(&state_)) return Result::kNone;
  age_ = now - state_.written;
  const bool proven = state_.resumed == Stamp::min() || state_.written - state_.resumed > kProven;
  if (age_ < Duration::zero() || age_ > kOldest || !proven) {
    memory_->clear();
    return proven ? Result::kTooOld : Result::kNotProven;
  }
  estimator->resume(state_.continuation);
  *node = state_.node;
  const Pose& here = state_.continuation.T_local_vehicle;
  terrain->grid().begin_restore(here.p.head<2>(), state_.terrain_start);
  for (std::size_t k = 0; k < terrain->grid().rows(); ++k) {
    if (memory_->read_row(k, row_.data())) terrain->grid().restore_row(row_.data());
  }
  terrain->restore_newest_points(state_.newest_points);
  resumed_ = now;
  return Result::kResumed;
}

void CheckpointKeeper::save(Stamp now, const Estimator& estimator, const TerrainDesk& terrain,
                            const NodeState& node) {
  if (!estimator.started()) return;
  state_ = {estimator.continuation(), now, resumed_, node, terrain.newest_points(),
            terrain.grid().start()};
  memory_->write_state(&state_);
  for (std::size_t k = 0; k < kRowsPerCycle; ++k) {
    terrain.grid().save_row(next_row_, row_.data());
    memory_->write_row(next_row_, row_.data());
    next_row_ = (next_row_ + 1) % terrain.grid().rows();
  }
}

}  // namespace rcs::wm
