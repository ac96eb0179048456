// Compares the terrain that WM makes of recorded scans with the simulated world: cells that are
// obstacles without one, and the range at which rocks, trunks and edges become obstacles. The poses
// are those of WM in the log, so that variants of WM see the same scans from the same places.
//   rcs drive SCENARIO --seeds 1..8 --logs -o FOLDER
//   terrain_study SCENARIO FOLDER/drive_1.log ... [--config config/demo3.toml] [--set
//   TABLE.KEY=VALUE ...]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "modules/wm/terrain/obstacle_sides.h"
#include "modules/wm/terrain/terrain_grid.h"
#include "modules/wm/wm_config.h"
#include "rcs/node/params/params.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"
#include "tools/recording/run_scans.h"

namespace rcs::test {
namespace {

constexpr double kNear_m = 4.0;  // from the centre of the vehicle
constexpr double kFar_m = 12.0;  // free cells are judged up to here
constexpr double kSector_rad = 0.7;
constexpr int kEvery = 5;  // scans from patch to patch
constexpr Duration kMaxGap = std::chrono::milliseconds(250);
constexpr double kContact_m = 0.3;  // higher objects are contacts
constexpr double kEdge_m = 0.35;    // and higher edges

enum Kind { kRockBare, kRockGrass, kHighRock, kEdge, kKinds };
constexpr const char* kNames[] = {"0.3 to 0.4 m, on bare ground", "0.3 to 0.4 m, in grass",
                                  "above 0.4 m", "edges above 0.35 m (cells)"};
constexpr const char* kCauses[] = {"", "hidden", "rock", "tall", "ledge", "side"};

/// What the vehicle must not touch, during its first approach.
struct Target {
  Kind kind = kRockBare;
  double nearest_m = 1e9;
  double detected_m = 0.0;  ///< from here on without a gap
  bool over = false;        ///< it has left the sector
  int seen = -1;            ///< number of the last patch with it in the sector
};

struct Tally {
  std::int64_t free = 0, meadow = 0, unknown = 0;
  std::map<std::pair<wm::ObstacleCause, bool>, std::int64_t> wrong;  ///< cause, in grass
  std::array<std::vector<double>, kKinds> detected_m;
};

class Study {
 public:
  Study(const sim::Scenario& scenario, const wm::TerrainParams& params, Tally* tally)
      : simulator_(scenario), grid_(params), tally_(tally) {
    grass_ = scenario.world.vegetation.grass_height_m > 0.0;
  }

  void use(const recording::PlacedScan& scan, const Pose& T_world_local) {
    grid_.insert(scan.p_vehicle, scan.T_world_vehicle);  // of the log: frame local
    if (scan.number == number_) return;
    number_ = scan.number;
    if (scan.number % kEvery != 0) return;
    judge(scan.T_world_vehicle, T_world_local);
  }

  void finish() {
    for (const auto& [key, t] : targets_) {
      if (t.nearest_m < 7.0) tally_->detected_m[t.kind].push_back(t.detected_m);
    }
  }

 private:
  void judge(const Pose& T_local_vehicle, const Pose& T_world_local) {
    const Cell first = grid_.patch(T_local_vehicle, &answers_);
    wm::join_sides(grid_.params().patch, grid_.params().side_m, &answers_);
    ++patches_;
    const Pose T_world_vehicle = T_world_local * T_local_vehicle;
    const Vec2 here = T_world_vehicle.p.head<2>();
    objects_.clear();
    simulator_.world().objects_near(here, 20.0, &objects_);
    const double cell_m = grid_.params().cell_m;
    const int side = grid_.params().patch;
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const Vec2 local = cell_m * Vec2(first.i + i + 0.5, first.j + j + 0.5);
        const Vec3 world = T_world_local * Vec3(local.x(), local.y(), 0.0);
        const Vec2 p = world.head<2>();
        double range_m = 0.0;
        if (!in_sector(T_world_vehicle, p, &range_m) || range_m > kFar_m + 2.0) continue;
        const wm::TerrainAnswer& a =
            answers_[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) +
                     static_cast<std::size_t>(i)];
        if (range_m < kFar_m && range_m > kNear_m && is_free(p)) note_free(a, p);
        if (edge_at(p) > kEdge_m) {
          const Cell key{static_cast<int>(std::floor(p.x() / cell_m)),
                         static_cast<int>(std::floor(p.y() / cell_m))};
          approach(&targets_[{1, key.i, key.j}], kEdge, range_m,
                   marked(first, p, 0.6, T_world_local));
        }
      }
    }
    for (const sim::Spheroid& o : objects_) {
      const Vec2 p = o.centre_world.head<2>();
      double range_m = 0.0;
      if (o.extinction_1pm > 0.0 || !in_sector(T_world_vehicle, p, &range_m)) continue;
      if (range_m > kFar_m + 2.0) continue;
      const double height_m =
          o.centre_world.z() + o.half_height_m - simulator_.world().height(p.x(), p.y());
      if (height_m < kContact_m) continue;
      const bool meadow = grass_ && simulator_.world().scatter().meadow(p.x(), p.y());
      const Kind kind = height_m > 0.4 ? kHighRock : meadow ? kRockGrass : kRockBare;
      approach(&targets_[{0, std::lround(100.0 * p.x()), std::lround(100.0 * p.y())}], kind,
               range_m, marked(first, p, o.radius_m + 0.2, T_world_local));
    }
    for (auto& [key, t] : targets_) t.over = t.over || t.seen != patches_;
  }

  [[nodiscard]] static bool in_sector(const Pose& T_world_vehicle, const Vec2& p, double* range_m) {
    const Vec2 to = p - T_world_vehicle.p.head<2>();
    const Vec2 ahead = (T_world_vehicle.q * Vec3::UnitX()).head<2>().normalized();
    *range_m = to.norm();
    return ahead.dot(to) > std::cos(kSector_rad) * *range_m;
  }

  [[nodiscard]] double edge_at(const Vec2& p) const {
    const sim::World& w = simulator_.world();
    const double d = sim::kEdge_m;
    return std::max(std::abs(w.height(p.x() + d, p.y()) - w.height(p.x() - d, p.y())),
                    std::abs(w.height(p.x(), p.y() + d) - w.height(p.x(), p.y() - d)));
  }

  /// Nothing there or close to it that a vehicle should avoid.
  [[nodiscard]] bool is_free(const Vec2& p) const {
    const sim::World& w = simulator_.world();
    for (const sim::Spheroid& o : objects_) {
      const double away_m = (o.centre_world.head<2>() - p).norm() - o.radius_m;
      if (away_m > 0.8) continue;
      const double ground_m = w.height(o.centre_world.x(), o.centre_world.y());
      if (o.centre_world.z() + o.half_height_m - ground_m > 0.15) return false;
    }
    for (int k = 0; k < 9; ++k) {
      const Vec2 at = p + 0.5 * Vec2(k % 3 - 1, k / 3 - 1);
      if (edge_at(at) > 0.2) return false;
    }
    return w.normal(p.x(), p.y()).z() > std::cos(radians(24.0));
  }

  void note_free(const wm::TerrainAnswer& a, const Vec2& p) {
    const bool meadow = grass_ && simulator_.world().scatter().meadow(p.x(), p.y());
    ++tally_->free;
    tally_->meadow += meadow ? 1 : 0;
    tally_->unknown += a.known ? 0 : 1;
    if (a.obstacle) ++tally_->wrong[{a.cause, meadow}];
  }

  /// Whether a cell with its centre within a distance of a place is an obstacle.
  [[nodiscard]] bool marked(Cell first, const Vec2& p_world, double within_m,
                            const Pose& T_world_local) const {
    const Vec3 local = T_world_local.inverse() * Vec3(p_world.x(), p_world.y(), 0.0);
    const double cell_m = grid_.params().cell_m;
    const int side = grid_.params().patch;
    const int reach = static_cast<int>(within_m / cell_m) + 1;
    const int ci = static_cast<int>(std::floor(local.x() / cell_m)) - first.i;
    const int cj = static_cast<int>(std::floor(local.y() / cell_m)) - first.j;
    for (int j = std::max(0, cj - reach); j <= std::min(side - 1, cj + reach); ++j) {
      for (int i = std::max(0, ci - reach); i <= std::min(side - 1, ci + reach); ++i) {
        const Vec2 centre = cell_m * Vec2(first.i + i + 0.5, first.j + j + 0.5);
        const bool obstacle =
            answers_[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) +
                     static_cast<std::size_t>(i)]
                .obstacle;
        if (obstacle && (centre - local.head<2>()).norm() < within_m) return true;
      }
    }
    return false;
  }

  void approach(Target* t, Kind kind, double range_m, bool detected) const {
    if (t->over || range_m < kNear_m + 0.5) return;
    t->kind = kind;
    t->seen = patches_;
    t->nearest_m = std::min(t->nearest_m, range_m);
    if (!detected) t->detected_m = 0.0;
    if (detected) t->detected_m = std::max(t->detected_m, range_m);
  }

  sim::Simulator simulator_;
  wm::TerrainGrid grid_;
  Tally* tally_;
  bool grass_ = false;
  std::uint32_t number_ = 0;
  int patches_ = 0;
  std::vector<wm::TerrainAnswer> answers_;
  std::vector<sim::Spheroid> objects_;
  std::map<std::array<std::int64_t, 3>, Target> targets_;
};

/// The number at the end of the stem of a log: drive_764.log.
std::int64_t seed_of(const std::string& log) {
  const std::string stem = std::filesystem::path(log).stem().string();
  return std::strtoll(stem.c_str() + stem.find_last_not_of("0123456789") + 1, nullptr, 10);
}

std::optional<std::string> study(const std::string& scenario_path, const std::string& log,
                                 const wm::WmConfig& config, Tally* tally) {
  sim::ScenarioOverrides overrides;
  overrides.seed = seed_of(log);
  const Result<sim::Scenario> scenario = sim::load_scenario(scenario_path, overrides);
  if (!scenario) return scenario.error().message;
  const Result<recording::RunLog> run = recording::read_run(log);
  if (!run) return run.error().message;
  recording::RunPoses poses;
  poses.world.reserve(run->nav.size());
  for (const recording::NavRecord& n : run->nav) {
    poses.world.push_back({n.stamp, n.T_local_vehicle});
  }
  poses.smooth = poses.world;
  Study one(*scenario, config.terrain, tally);
  const auto use = [&](const recording::PlacedScan& scan) {
    const std::optional<Pose> truth = tools::pose_at(run->truth, scan.reference, kMaxGap);
    if (truth) one.use(scan, *truth * scan.T_world_vehicle.inverse());
  };
  const Result<recording::ScanCount> count =
      recording::for_each_scan(log, poses, std::nullopt, use, [](double) { return true; });
  if (!count) return count.error().message;
  one.finish();
  return std::nullopt;
}

double percent(std::int64_t part, std::int64_t whole) {
  return 100.0 * static_cast<double>(part) / static_cast<double>(std::max<std::int64_t>(1, whole));
}

void print(const Tally& t) {
  std::int64_t wrong = 0;
  std::map<wm::ObstacleCause, std::array<std::int64_t, 2>> by_cause;
  for (const auto& [key, n] : t.wrong) {
    by_cause[key.first][key.second ? 1 : 0] += n;
    wrong += n;
  }
  fmt::print("free cells within {} m: {}, {:.1f} % in grass, {:.2f} % unknown\n", kFar_m, t.free,
             percent(t.meadow, t.free), percent(t.unknown, t.free));
  fmt::print("of these obstacles: {} ({:.3f} %)", wrong, percent(wrong, t.free));
  for (const auto& [cause, n] : by_cause) {
    fmt::print("; {} {} + {} in grass", kCauses[static_cast<int>(cause)], n[0], n[1]);
  }
  fmt::print("\n");
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    std::vector<double> m = t.detected_m[kind];
    if (m.empty()) continue;
    std::sort(m.begin(), m.end());
    const auto below = [&](double limit_m) {
      return std::lower_bound(m.begin(), m.end(), limit_m) - m.begin();
    };
    fmt::print("{:<30} {:5}: never {}, below 6 m {}, 8 m {}, 10 m {}; median {:.1f} m\n",
               kNames[kind], m.size(), below(1.0), below(6.0), below(8.0), below(10.0),
               m[m.size() / 2]);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Terrain of recorded drives, compared with the simulated world");
  std::string scenario;
  std::vector<std::string> logs;
  std::string config = "config/demo3.toml";
  std::vector<std::string> set;
  app.add_option("scenario", scenario)->required();
  app.add_option("logs", logs, "drive_SEED.log")->required();
  app.add_option("--config", config);
  app.add_option("--set", set, "TABLE.KEY=VALUE, as for rcs replay");
  CLI11_PARSE(app, argc, argv);
  const Result<ParamFile> file = ParamFile::load(config, set);
  const Result<wm::WmConfig> wm =
      file ? wm::load_wm_config(*file) : Result<wm::WmConfig>(file.error());
  if (!wm) {
    fmt::print(stderr, "{}\n", wm.error().message);
    return 3;
  }
  Tally tally;
  for (const std::string& log : logs) {
    if (const std::optional<std::string> error = study(scenario, log, *wm, &tally)) {
      fmt::print(stderr, "{}\n", *error);
      return 3;
    }
  }
  print(tally);
  return 0;
}

}  // namespace
}  // namespace rcs::test

int main(int argc, char** argv) {
  try {
    return rcs::test::run(argc, argv);
  } catch (const std::exception& e) {
    std::fputs(e.what(), stderr);
    return 3;
  }
}
