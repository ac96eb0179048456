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
  /// Older: the vehicle may have been moved; start as usual.
  static constexpr Duration kOldest = from_seconds(5.0);
  /// A state whose successor ended again within this time may have ended it: it is not used twice.
  static constexpr Duration kProven = from_seconds(10.0);

  [[nodiscard]] static CheckpointLayout layout(const TerrainGrid& grid);

  explicit CheckpointKeeper(std::unique_ptr<CheckpointMemory> memory)
      : memory_(std::move(memory)) {}

  /// What the node itself continues with.
  struct NodeState {
    Stamp local_began = Stamp::min();   ///< names frame local
    std::int64_t registration_seq = 0;  ///< newest of SP_REGISTRATION that was received; 0: none
  };

  enum class Result { kNone, kResumed, kTooOld, kNotProven };
  /// Before any input, in the first cycle. Sets the parameters if the result is kResumed.
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
    Stamp resumed = Stamp::min();  // node time at which this process began with such a state
    NodeState node;
    Stamp newest_points = Stamp::min();
    Vec2 terrain_start = Vec2::Zero();
  };

  std::unique_ptr<CheckpointMemory> memory_;
  State state_;
  Stamp resumed_ = Stamp::min();
  Duration age_{};
  std::size_t next_row_ = 0;
  std::vector<std::byte> row_;
};

}  // namespace rcs::wm
