#pragma once
// What a restarted WM continues with: the belief and the terrain, in memory of `rcs up` that
// outlives the process. A WM without them stands for ten seconds to level itself, drives ahead to
// find its heading, and knows no obstacle in the blind zone of the LADAR.

#include <memory>
#include <string>
#include <vector>

#include "modules/wm/estimator.h"
#include "modules/wm/terrain/terrain_node.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/process/checkpoint_memory.h"

namespace rcs::wm {

class CheckpointKeeper {
 public:
  /// An older belief is not continued with: the vehicle may have been moved.
  static constexpr Duration kOldest = from_seconds(5.0);
  /// The terrain ahead of a vehicle that was at rest is used for longer after its last scan, also
  /// by another run.
  static constexpr Duration kOldestTerrain = kCheckpointOutdated;
  /// A state whose successor ended again within this time of its use may have ended it: its belief
  /// is not used twice, its terrain not more than kMaxUnproven times.
  static constexpr Duration kProven = from_seconds(10.0);
  static constexpr int kMaxUnproven = 3;

  [[nodiscard]] static CheckpointLayout layout(const TerrainGrid& grid);

  CheckpointKeeper(std::unique_ptr<CheckpointMemory> memory, const Publisher& publisher)
      : memory_(std::move(memory)), publisher_(publisher) {}

  /// What the node itself continues with.
  struct NodeState {
    Stamp local_began = Stamp::min();   ///< names frame local
    std::int64_t registration_seq = 0;  ///< newest of SP_REGISTRATION that was received; 0: none
  };

  enum class Result {
    kNone,
    kResumed,
    kTerrain,  ///< of a vehicle at rest, to be verified by the first scan; the belief is not used
    kTooOld,
    kNotProven
  };
  /// Before any input, in the first cycle. Sets `node` if the result is kResumed.
  Result resume(Stamp now, Estimator* estimator, TerrainServer* terrain, NodeState* node);
  /// Age of the state at resume().
  [[nodiscard]] Duration age() const { return age_; }

  /// Before the terrain takes a scan, once a cycle: counts the use of a restored terrain.
  void before_terrain(const Estimator& estimator, const TerrainServer& terrain);

  /// Once a cycle: the state, and some rows of the terrain; all once restored terrain is verified.
  void save(Stamp now, const Estimator& estimator, const TerrainServer& terrain,
            const NodeState& node);

 private:
  /// Copied as bytes: contains no pointers, and only the same program file reads it.
  struct State {
    Continuation continuation;
    Stamp written = Stamp::min();  // node time
    std::int64_t run_id = 0;
    std::int64_t boot_id = 0;
    bool at_rest = false;
    int unproven = 0;  // processes in a row that have used such a state, none for kProven
    NodeState node;
    Stamp newest_points = Stamp::min();
    Stamp scanned = Stamp::min();  // node time
    Vec2 terrain_start = Vec2::Zero();
  };

  [[nodiscard]] Result usable(Stamp now) const;
  void count_use();

  std::unique_ptr<CheckpointMemory> memory_;
  Publisher publisher_;
  State state_;
  Stamp used_ = Stamp::min();  // node time at which this process used a state
  bool counted_ = false;       // the use of a restored terrain
  bool other_frame_ = false;   // the rows in the memory are in the frame of a predecessor
  int unproven_ = 0;
  Duration age_{};
  std::size_t next_row_ = 0;
  std::vector<std::byte> row_;
};

}  // namespace rcs::wm
