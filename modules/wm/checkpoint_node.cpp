#include "modules/wm/checkpoint_node.h"

#include <type_traits>

#include "lcmtypes/plausible.h"

namespace rcs::wm {
namespace {

/// All rows of 512 in a second.
constexpr std::size_t kRowsPerCycle = 10;

}  // namespace

CheckpointLayout CheckpointKeeper::layout(const TerrainGrid& grid) {
  static_assert(std::is_trivially_destructible_v<State>, "copied as bytes");
  return {sizeof(State), grid.rows(), grid.row_bytes()};
}

CheckpointKeeper::Result CheckpointKeeper::usable(Stamp now) const {
  const auto within_age = [](Duration age, Duration oldest) {
    return age >= Duration::zero() && age <= oldest;
  };
  const bool recent =
      state_.run_id == publisher_.run_id && within_age(now - state_.written, kOldest);
  if (recent && state_.unproven == 0) return Result::kResumed;
  // Rows are written, and so the belief, also while nothing is received.
  const bool at_rest = state_.at_rest && state_.boot_id == publisher_.boot_id &&
                       state_.scanned > Stamp::min() &&
                       within_age(now - state_.scanned, kOldestTerrain) &&
                       within(state_.continuation.T_local_vehicle.p, kFarthest_m);
  if (!at_rest) return recent ? Result::kNotProven : Result::kTooOld;
  return state_.unproven < kMaxUnproven ? Result::kTerrain : Result::kNotProven;
}

CheckpointKeeper::Result CheckpointKeeper::resume(Stamp now, Estimator* estimator,
                                                  TerrainServer* terrain, NodeState* node) {
  row_.resize(terrain->grid().row_bytes());
  if (!memory_->read_state(&state_)) return Result::kNone;
  age_ = now - state_.written;
  const Result result = usable(now);
  if (result != Result::kResumed && result != Result::kTerrain) {
    memory_->clear();
    return result;
  }
  unproven_ = state_.unproven;
  if (result == Result::kResumed) count_use();
  const Pose& here = state_.continuation.T_local_vehicle;
  terrain->grid().begin_restore(here.p.head<2>(), state_.terrain_start);
  for (std::size_t k = 0; k < terrain->grid().rows(); ++k) {
    if (memory_->read_row(k, row_.data())) terrain->grid().restore_row(row_.data());
  }
  if (result == Result::kTerrain) {
    terrain->verify_restored({here, state_.scanned + kOldestTerrain});
    return result;
  }
  estimator->resume(state_.continuation);
  *node = state_.node;
  terrain->restore_newest_scan(state_.newest_points, state_.scanned);
  used_ = now;
  return result;
}

/// This process may end before it writes a state of its own.
void CheckpointKeeper::count_use() {
  unproven_ = ++state_.unproven;
  memory_->write_state(&state_);
  counted_ = true;
}

void CheckpointKeeper::before_terrain(const Estimator& estimator, const TerrainServer& terrain) {
  if (terrain.restored() && estimator.started() && !counted_) count_use();
}

void CheckpointKeeper::save(Stamp now, const Estimator& estimator, const TerrainServer& terrain,
                            const NodeState& node) {
  // The terrain that was restored is in another frame until it is verified.
  if (terrain.restored()) {
    used_ = now;
    other_frame_ = true;
  }
  if (!estimator.started() || terrain.restored()) return;
  if (other_frame_) memory_->clear();
  if (unproven_ > 0 && now - used_ > kProven) unproven_ = 0;
  const Belief& b = estimator.state().belief;
  state_ = {estimator.continuation(),
            now,
            publisher_.run_id,
            publisher_.boot_id,
            at_rest(b),
            unproven_,
            node,
            terrain.newest_points(),
            terrain.scanned(),
            terrain.grid().start()};
  memory_->write_state(&state_);
  const std::size_t rows = other_frame_ ? terrain.grid().rows() : kRowsPerCycle;
  other_frame_ = false;
  for (std::size_t k = 0; k < rows; ++k) {
    terrain.grid().save_row(next_row_, row_.data());
    memory_->write_row(next_row_, row_.data());
    next_row_ = (next_row_ + 1) % terrain.grid().rows();
  }
}

}  // namespace rcs::wm
