#include "modules/wm/checkpoint_node.h"

#include <type_traits>

namespace rcs::wm {
namespace {

/// All rows of 512 in a second.
constexpr std::size_t kRowsPerCycle = 10;
constexpr double kRest_mps = 0.1;

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
  const bool recent = state_.run_id == run_id_ && age_ <= kOldest;
  const bool whole = recent && state_.unproven == 0;
  const bool terrain_only =
      state_.at_rest && age_ <= kOldestTerrain && state_.unproven < kMostUnproven;
  if (age_ < Duration::zero() || (!whole && !terrain_only)) {
    memory_->clear();
    return state_.unproven > 0 ? Result::kNotProven : Result::kTooOld;
  }
  resumed_ = now;
  unproven_ = ++state_.unproven;
  memory_->write_state(&state_);  // this process may end before it writes one of its own
  const Pose& here = state_.continuation.T_local_vehicle;
  terrain->grid().begin_restore(here.p.head<2>(), state_.terrain_start);
  for (std::size_t k = 0; k < terrain->grid().rows(); ++k) {
    if (memory_->read_row(k, row_.data())) terrain->grid().restore_row(row_.data());
  }
  if (!whole) {
    terrain->verify_restored();
    estimator->begin_local_at(here);
    return Result::kTerrain;
  }
  estimator->resume(state_.continuation);
  *node = state_.node;
  terrain->restore_newest_points(state_.newest_points);
  return Result::kResumed;
}

void CheckpointKeeper::save(Stamp now, const Estimator& estimator, const TerrainDesk& terrain,
                            const NodeState& node) {
  if (!estimator.started()) return;
  if (unproven_ > 0 && now - resumed_ > kProven) unproven_ = 0;
  const bool at_rest = estimator.state().belief.x.v_world.norm() < kRest_mps;
  state_ = {
      estimator.continuation(), now, run_id_, at_rest, unproven_, node, terrain.newest_points(),
      terrain.grid().start()};
  memory_->write_state(&state_);
  for (std::size_t k = 0; k < kRowsPerCycle; ++k) {
    terrain.grid().save_row(next_row_, row_.data());
    memory_->write_row(next_row_, row_.data());
    next_row_ = (next_row_ + 1) % terrain.grid().rows();
  }
}

}  // namespace rcs::wm
