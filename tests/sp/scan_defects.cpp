#include "tests/sp/scan_defects.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "tests/support/still_scan.h"
#include "tools/studies/simulated_scans.h"

namespace rcs::test {
namespace {

constexpr double kReach_m = 400.0;  // of the world around its origin
constexpr double kRoom_m = 3.0;     // without trees and rocks around the vehicle
constexpr double kLookout_m = 250.0;
constexpr double kTurn_rad = radians(5.0);  // of the vehicle between two scans, at most

/// A vehicle at rest.
class Lookout {
 public:
  Lookout(const ScanPlace& place, const sim::Scenario& reference, std::uint64_t seed)
      : spinning_(place.scanner == Scanner::kSpinning),
        mount_(studies::without_error(reference.mount)),
        world_(place.world, reference.dem, {Vec2(0.0, 0.0), Vec2(1.0, 0.0)}, kReach_m),
        imager_(reference.imager, reference.beam, mount_, seed),
        turning_(spinning_params(), reference.beam, mount_, seed),
        calibration_(studies::ladar_in_mount(reference)) {}

  [[nodiscard]] bool has_room(const Vec2& place_world) {
    world_.objects_near(place_world, kRoom_m, &objects_);
    return objects_.empty();
  }

  [[nodiscard]] Pose T_world_ladar(const Vec2& place_world, double heading_rad) const {
    return T_world_standing(world_, place_world, heading_rad) * mount_.T_vehicle_mount;
  }

  Points scan(const Vec2& place_world, double heading_rad) {
    const Pose T = T_world_standing(world_, place_world, heading_rad);
    return spinning_ ? turn(at_rest(T)) : image_at_rest(world_, T, calibration_, &imager_);
  }

 private:
  [[nodiscard]] static sim::SpinningParams spinning_params() {
    sim::SpinningParams p;
    p.cols = 192;
    return p;
  }
  Points turn(const sim::Trajectory& still) {
    Points points;
    sim::PointSector sector;
    for (int s = 0; s < turning_.params().sectors; ++s) {
      turning_.render(world_, still, 0.0, s, &sector);
      for (std::size_t i = 0; i < sector.x_m.size(); ++i) {
        points.push_back(Vec3f(sector.x_m[i], sector.y_m[i], sector.z_m[i]));
      }
    }
    return points;
  }

  bool spinning_;
  sim::MountParams mount_;
  sim::World world_;
  sim::RangeImager imager_;
  sim::SpinningLadar turning_;
  sp::Calibration calibration_;
  std::vector<sim::Spheroid> objects_;
};

double uniform(double low, double high, std::mt19937* rng) {
  return std::uniform_real_distribution<double>(low, high)(*rng);
}

double azimuth(const Vec3f& p) { return std::atan2(p.y(), p.x()); }

template <class Keep>
Points those(const Points& points, const Keep& keep) {
  Points kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (keep(points[i])) kept.push_back(points[i]);
  }
  return kept;
}

/// The azimuth that has a `share` of the points below it.
double azimuth_below(const Points& points, double share) {
  std::vector<double> all;
  for (std::size_t i = 0; i < points.size(); ++i) all.push_back(azimuth(points[i]));
  const auto rank =
      std::min(all.size() - 1, static_cast<std::size_t>(share * static_cast<double>(all.size())));
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(rank), all.end());
  return all[rank];
}

/// Azimuths that are kept when a `share` of the points is not.
struct Sector {
  double low = -kPi;
  double high = kPi;

  [[nodiscard]] bool has(const Vec3f& p) const { return azimuth(p) >= low && azimuth(p) <= high; }
};

Sector without(double share, const Points& points, std::mt19937* rng) {
  Sector sector;
  if (uniform(0.0, 1.0, rng) < 0.5) {
    sector.low = azimuth_below(points, share);
  } else {
    sector.high = azimuth_below(points, 1.0 - share);
  }
  return sector;
}

}  // namespace

std::vector<ScanPlace> scan_places(const sim::Scenario& reference) {
  sim::WorldParams bare = reference.world;
  bare.vegetation.bushes_per_m2 = bare.vegetation.trees_per_m2 = 0.0;
  bare.vegetation.grass_height_m = 0.0;
  std::vector<ScanPlace> all = {{"bare hills", Scanner::kImager, bare},
                                {"rocks", Scanner::kImager, bare},
                                {"wooded hills", Scanner::kImager, reference.world},
                                {"bare hills", Scanner::kSpinning, bare},
                                {"rocks", Scanner::kSpinning, bare},
                                {"wooded hills", Scanner::kSpinning, reference.world}};
  all[1].world.rocks.per_m2 = all[4].world.rocks.per_m2 = 0.1;
  for (std::size_t k = 0; k < all.size(); ++k) all[k].world.seed = 8001 + k;
  return all;
}

std::vector<KnownPair> known_pairs(const ScanPlace& place, const sim::Scenario& reference,
                                   double apart_m, int count) {
  std::mt19937 rng(static_cast<unsigned>(place.world.seed));
  Lookout lookout(place, reference, place.world.seed);
  std::vector<KnownPair> pairs;
  while (pairs.size() < static_cast<std::size_t>(count)) {
    const double x = uniform(-kLookout_m, kLookout_m, &rng);
    const Vec2 from(x, uniform(-kLookout_m, kLookout_m, &rng));
    const double way = uniform(-kPi, kPi, &rng);
    const Vec2 to = from + apart_m * Vec2(std::cos(way), std::sin(way));
    if (!lookout.has_room(from) || !lookout.has_room(to)) continue;
    const double heading = uniform(-kPi, kPi, &rng);
    const double later = heading + uniform(-kTurn_rad, kTurn_rad, &rng);
    KnownPair pair;
    pair.model = lookout.scan(from, heading);
    pair.data = lookout.scan(to, later);
    pair.T_model_data =
        lookout.T_world_ladar(from, heading).inverse() * lookout.T_world_ladar(to, later);
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

void add_outliers(double share, std::mt19937* rng, KnownPair* pair) {
  Points& data = pair->data;
  const auto range = [](const std::vector<float>& v) {
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    return std::uniform_real_distribution<float>(*low, *high);
  };
  auto x = range(data.x);
  auto y = range(data.y);
  auto z = range(data.z);
  std::vector<std::size_t> order(data.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), *rng);
  order.resize(static_cast<std::size_t>(share * static_cast<double>(data.size())));
  for (const std::size_t i : order) {
    data.x[i] = x(*rng);
    data.y[i] = y(*rng);
    data.z[i] = z(*rng);
  }
}

void occlude(double share, std::mt19937* rng, KnownPair* pair) {
  const Sector seen = without(share, pair->data, rng);
  pair->data = those(pair->data, [&seen](const Vec3f& p) { return seen.has(p); });
}

void move_objects(double share, std::mt19937* rng, KnownPair* pair) {
  Points& data = pair->data;
  constexpr double kObject = 0.05;
  const auto size = static_cast<std::size_t>(kObject * static_cast<double>(data.size()));
  std::vector<std::size_t> still(data.size());
  std::iota(still.begin(), still.end(), std::size_t{0});
  const auto objects = static_cast<int>(std::lround(share / kObject));
  for (int k = 0; k < objects; ++k) {
    std::uniform_int_distribution<std::size_t> any(0, still.size() - 1);
    const Vec3f middle = data[still[any(*rng)]];
    const auto nearer = [&](std::size_t a, std::size_t b) {
      return (data[a] - middle).squaredNorm() < (data[b] - middle).squaredNorm();
    };
    const auto end = still.begin() + static_cast<std::ptrdiff_t>(size);
    std::nth_element(still.begin(), end, still.end(), nearer);
    const double way = uniform(-kPi, kPi, rng);
    const double far_m = uniform(0.5, 2.0, rng);
    for (auto i = still.begin(); i != end; ++i) {
      data.x[*i] += static_cast<float>(far_m * std::cos(way));
      data.y[*i] += static_cast<float>(far_m * std::sin(way));
    }
    still.erase(still.begin(), end);
  }
}

void crop_model(double share, std::mt19937* rng, KnownPair* pair) {
  Points seen;  // as the model sees the data
  for (std::size_t i = 0; i < pair->data.size(); ++i) {
    seen.push_back((pair->T_model_data * pair->data[i].cast<double>()).cast<float>());
  }
  const Sector covered = without(share, seen, rng);
  pair->model = those(pair->model, [&covered](const Vec3f& p) { return covered.has(p); });
}

}  // namespace rcs::test
