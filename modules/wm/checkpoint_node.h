#pragma once
// What a restarted WM continues with: the belief and the terrain, in memory of `rcs up` that
// outlives the process. A WM without them stands for ten seconds to level itself, drives ahead to
// find its heading, and knows no obstacle in the blind zone of the LADAR.

#include <memory>
#include <string>
#include <vector>

#include "modules/wm/estimator.h"
#include "modules/wm/terrain/terrain_node.h"
#include "rcs/node/process/checkpoint_memory.h"

namespace rcs::wm {

class CheckpointKeeper {
 public:
  /// An older belief is not continued with: the vehicle may have been moved.
  static constexpr Duration kOldest = from_seconds(5.0);
  /// The terrain around a vehicle that was at rest is used for longer, also by another run: what
  /// has changed in the blind zone of the LADAR meanwhile is unknown in any case.
  static constexpr Duration kOldestTerrain = kCheckpointOutdated;
  /// A state whose successor ended again within this time may have ended it: its belief is not used
  /// twice, its terrain not more than kMostUnproven times.
  static constexpr Duration kProven = from_seconds(10.0);
  static constexpr int kMostUnproven = 3;

  [[nodiscard]] static CheckpointLayout layout(const TerrainGrid& grid);

  /// @param run_id  see Publisher
  CheckpointKeeper(std::unique_ptr<CheckpointMemory> memory, std::int64_t run_id)
      : memory_(std::move(memory)), run_id_(run_id) {}

  /// What the node itself continues with.
  struct NodeState {
    Stamp local_began = Stamp::min();   ///< names frame local
    std::int64_t registration_seq = 0;  ///< newest of SP_REGISTRATION that was received; 0: none
  };

  enum class Result {
    kNone,
    kResumed,
    kTerrain,  ///< of a vehicle at rest, where frame local will begin; the belief is not used
    kTooOld,
    kNotProven
  };
  /// Before any input, in the first cycle. Sets `node` if the result is kResumed.
  Result resume(Stamp now, Estimator* estimator, TerrainDesk* terrain, NodeState* node);
  /// Age of the state at resume().
  [[nodiscard]] Duration age() const { return age_; }

  /// Once a cycle: the state, and some rows of the terrain.
  void save(Stamp now, const Estimator& estimator, const TerrainDesk& terrain,
            const NodeState& node);

 private:
  /// Copied as bytes: contains no pointers, and only the same program file reads it.
  struct State {
    Continuation continuation;
    Stamp written = Stamp::min();  // node time
    std::int64_t run_id = 0;
    bool at_rest = false;
    int unproven = 0;  // processes in a row that have used such a state, none for kProven
    NodeState node;
    Stamp newest_points = Stamp::min();
    Vec2 terrain_start = Vec2::Zero();
  };

  std::unique_ptr<CheckpointMemory> memory_;
  std::int64_t run_id_;
  State state_;
  Stamp resumed_ = Stamp::min();  // node time at which this process began with a state
  int unproven_ = 0;
  Duration age_{};
  std::size_t next_row_ = 0;
  std::vector<std::byte> row_;
};

}  // namespace rcs::wm
