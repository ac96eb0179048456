#pragma once
// Source of the sensor messages of a drill: a log, or a scenario that is rendered once for all of
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

/// A sequence of messages in memory.
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

/// Parameters of a scene; equal keys share one rendering.
struct SceneKey {
  std::string log;  ///< path; or:
  std::string scenario;
  std::string ins;  ///< INS grade; empty: that of the scenario
  std::int64_t seed = 1;

  bool operator==(const SceneKey& o) const {
    return log == o.log && scenario == o.scenario && ins == o.ins && seed == o.seed;
  }
};

/// Rendered when first opened, by the first thread, and released after its last use.
class Scene {
 public:
  explicit Scene(SceneKey key) : key_(std::move(key)) {}

  [[nodiscard]] const SceneKey& key() const { return key_; }
  /// Call it before the first open().
  /// @param length_s  required length; 0: all
  void add_user(double length_s);
  /// Call it once for each add_user().
  void done();

  /// The sensor messages and SIM_TRUTH; valid until done(). From any thread.
  /// @param length_s  0: all
  /// @param stop  polled; true ends the rendering
  /// @param progress  called with the share of the scene that is rendered, then read; may be empty
  [[nodiscard]] Result<std::unique_ptr<EventSource>> open(
      double length_s, const std::function<bool()>& stop,
      const std::function<void(double)>& progress);
  /// The a priori map of the course of a rendered scene; valid until done(). From any thread.
  /// @param cell_m  0: that of the scenario
  [[nodiscard]] const sim::PriorMap& prior_map(double cell_m);

 private:
  [[nodiscard]] Outcome render(const std::function<bool()>& stop,
                               const std::function<void(double)>& progress);

  SceneKey key_;
  std::mutex rendering_;
  std::unique_ptr<const Recording> recording_;
  std::unique_ptr<const sim::Simulator> simulator_;  ///< at the end of the drive
  std::map<double, sim::PriorMap> prior_maps_;       ///< by cell size
  std::atomic<int> users_{0};
  double longest_s_ = 0.0;
  bool whole_ = false;
};

}  // namespace rcs::drills
