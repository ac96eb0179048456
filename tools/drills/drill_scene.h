#pragma once
// Where a drill's sensor messages come from: a log, or a scenario that is rendered once for all of
// its drills.

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/simulator.h"

namespace rcs::drills {

/// A stretch of messages in memory.
class Recording {
 public:
  void add(Stamp due, const SourceEvent& event);

  [[nodiscard]] std::size_t size() const { return items_.size(); }
  [[nodiscard]] Stamp due(std::size_t i) const { return items_[i].due; }
  void copy(std::size_t i, SourceEvent* event) const;

 private:
  struct Item {
    Stamp due;
    std::size_t channel;
    std::size_t begin;  // in bytes_
    std::size_t size;
  };

  std::vector<std::string> channels_;
  std::vector<Item> items_;
  std::vector<std::uint8_t> bytes_;
};

/// What a scene is made of; equal keys share one rendering.
struct SceneKey {
  std::string log;  ///< path; or:
  std::string scenario;
  std::string ins;  ///< grade; empty: the scenario's
  std::int64_t seed = 1;

  bool operator==(const SceneKey& o) const {
    return log == o.log && scenario == o.scenario && ins == o.ins && seed == o.seed;
  }
};

/// Rendered when first opened, by whoever is first, and given up after its last use.
class Scene {
 public:
  explicit Scene(SceneKey key) : key_(std::move(key)) {}

  [[nodiscard]] const SceneKey& key() const { return key_; }
  /// Before anybody opens it.
  /// @param length_s  that the user needs; 0: all
  void add_user(double length_s);
  /// Call it as often as add_user().
  void done();

  /// Its sensor messages and SIM_TRUTH; outlived by the scene until done(). From any thread.
  /// @param length_s  0: all
  /// @param stop  asked now and then
  [[nodiscard]] Result<std::unique_ptr<EventSource>> open(double length_s,
                                                          const std::function<bool()>& stop);
  /// Of a rendered scene: the course's a priori map; outlived by the scene until done(). From any
  /// thread.
  /// @param cell_m  instead of the scenario's; 0: as that says
  [[nodiscard]] const sim::PriorMap& prior_map(double cell_m);

 private:
  [[nodiscard]] Outcome render(const std::function<bool()>& stop);

  SceneKey key_;
  std::mutex rendering_;
  std::unique_ptr<const Recording> recording_;
  std::unique_ptr<const sim::Simulator> simulator_;  ///< at the end of its drive
  std::map<double, sim::PriorMap> prior_maps_;       ///< by cell
  std::atomic<int> users_{0};
  double longest_s_ = 0.0;
  bool whole_ = false;
};

}  // namespace rcs::drills
