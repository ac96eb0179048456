#pragma once
// Predicted position uncertainty along a path without GPS: answers path queries, one point a cycle.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "modules/wm/filter.h"
#include "modules/wm/wm_config.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"
#include "rcs/prior/prior_terrain.h"
#include "rcs/terrain/localizability.h"

namespace rcs::wm {

class PathUncertaintyServer {
 public:
  /// @param prior  the a priori map; its window moves along the paths
  PathUncertaintyServer(const PathUncertaintyParams& params, PriorTerrain prior, Bus* bus);

  /// Once a cycle: receives queries and computes at most one point of the current one. Waits while
  /// a tile of the map is being read.
  /// @param state  null: the pose in frame world is unknown
  /// @param datum  of frame world; null: unknown
  void step(const FilterState* state, const LocalFrame* datum, Stamp now, Report* report);

  [[nodiscard]] const InboxBase& inbox() const { return queries_; }

 private:
  void accept(const path_query_t& query, const FilterState* state, const LocalFrame* datum,
              Stamp now, Report* report);
  void begin(const path_query_t& query, const FilterState* state, const LocalFrame* datum);
  [[nodiscard]] bool read_path(const path_query_t& query, const Vec2& start);
  void walk(Stamp now, Report* report);
  void answer(std::int8_t state);

  PathUncertaintyParams params_;
  PriorTerrain prior_;
  Inbox<path_query_t> queries_;
  Outbox<path_uncertainty_t> answers_;
  PathUncertaintyWalk walk_;
  std::vector<Vec2> path_m_;  // frame world
  path_uncertainty_t answer_{};
  bool asked_ = false;  // answer_ holds the answer to a query
  bool walking_ = false;
  bool uses_map_ = false;
};

}  // namespace rcs::wm
