#include "tests/support/street_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "rcs/base/kd_tree.h"
#include "tools/clouds/survey_points.h"
#include "tools/mapping/coarser.h"

namespace rcs::test {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kVehicle_m = 0.3;  // the vehicle frame above the ground
constexpr double kLadar_m = 1.6;    // the LADAR above the vehicle frame
constexpr double kMaxRange_m = 80.0;
constexpr double kRangeNoise_m = 0.02;

/// What stands on the street, in its frame: an upright box.
struct Box {
  Vec2 low, high;
  double top_m = 0.0;  ///< above the ground of its centre
};

/// Frame street: x along its axis, y to the left.
struct Street {
  struct Wave {
    double amplitude_m, number, phase;
  };
  struct Driveway {
    double x_m, side;
  };
  Pose T_map_street;
  bool kerbs = false;
  std::vector<Wave> waves;
  std::vector<Driveway> driveways;
  double side_street_m = 0.0;
  double half_m = 4.5;  ///< of the carriageway

  [[nodiscard]] double kerb(double x, double y) const {
    constexpr double kKerb_m = 0.12;
    constexpr double kLow_m = 0.02;
    constexpr double kRamp_m = 0.15;
    constexpr double kDriveway_m = 1.8;
    constexpr double kSideStreet_m = 3.5;
    double beyond = std::abs(y) - half_m;
    if (y > 0.0) beyond = std::min(beyond, std::abs(x - side_street_m) - kSideStreet_m);
    double top = kKerb_m;
    for (const Driveway& d : driveways) {
      if (d.side * y > 0.0 && std::abs(x - d.x_m) < kDriveway_m) top = kLow_m;
    }
    return top * std::clamp(beyond / kRamp_m, 0.0, 1.0);
  }

  [[nodiscard]] double height(double map_x, double map_y) const {
    constexpr double kCrown = 0.02;
    const Vec3 p = T_map_street.inverse() * Vec3(map_x, map_y, 0.0);
    double z = -kCrown * std::min(std::abs(p.y()), half_m);
    for (const Wave& w : waves) z += w.amplitude_m * std::sin(w.number * p.x() + w.phase);
    return kerbs ? z + kerb(p.x(), p.y()) : z;
  }
};

Street make_street(const StreetParams& params, std::mt19937* rng) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Street s;
  s.kerbs = params.kerbs;
  s.T_map_street.q = exp_so3(Vec3(0.0, 0.0, kPi * u(*rng)));
  constexpr int kWaves = 3;
  for (int k = 0; k < kWaves; ++k) {
    const double length_m = 40.0 * std::pow(2.0, k) * (1.0 + 0.2 * u(*rng));
    const double number = 2.0 * kPi / length_m;
    s.waves.push_back(
        {std::tan(params.slope_rad) * std::sqrt(2.0 / kWaves) / number, number, kPi * u(*rng)});
  }
  s.side_street_m = 25.0 * u(*rng);
  for (int k = 0; k < 6; ++k) s.driveways.push_back({35.0 * u(*rng), k % 2 == 0 ? 1.0 : -1.0});
  return s;
}

std::vector<Box> make_boxes(const Street& s, std::mt19937* rng) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<Box> boxes;
  for (int k = 0; k < 8; ++k) {  // parked cars
    const double x = 40.0 * u(*rng);
    const double y = (k % 2 == 0 ? 1.0 : -1.0) * (s.half_m - 1.2);
    if (std::abs(x) < 6.0) continue;  // not on the vehicle
    boxes.push_back({{x - 2.2, y - 0.9}, {x + 2.2, y + 0.9}, 1.5});
  }
  for (int k = 0; k < 10; ++k) {  // buildings
    const double x = 60.0 * u(*rng);
    const double side = k % 2 == 0 ? 1.0 : -1.0;
    const double near = s.half_m + 4.5 + 1.5 * u(*rng);
    const double far = near + 12.0;
    boxes.push_back({{x - 8.0, side > 0 ? near : -far}, {x + 8.0, side > 0 ? far : -near}, 8.0});
  }
  return boxes;
}

Pose standing_on(const GroundHeight& ground, const Vec2& at, double heading_rad) {
  constexpr double kBase_m = 1.4;
  const Vec2 slope((ground(at.x() + kBase_m, at.y()) - ground(at.x() - kBase_m, at.y())),
                   (ground(at.x(), at.y() + kBase_m) - ground(at.x(), at.y() - kBase_m)));
  const Vec3 up =
      Vec3(-slope.x() / (2.0 * kBase_m), -slope.y() / (2.0 * kBase_m), 1.0).normalized();
  const Quat level = Quat::FromTwoVectors(Vec3::UnitZ(), up);
  return {level * exp_so3(Vec3(0.0, 0.0, heading_rad)),
          Vec3(at.x(), at.y(), ground(at.x(), at.y())) + kVehicle_m * up};
}

/// Range to the ground; NaN: none. Secant steps from the plane below the LADAR: the ground is
/// nearly level.
double ground_range(const GroundHeight& ground, const Vec3& from, const Vec3& ray) {
  constexpr double kSteepest = -0.01;
  if (ray.z() > kSteepest) return kUnknown;
  const auto above = [&](double r) {
    const Vec3 p = from + r * ray;
    return p.z() - ground(p.x(), p.y());
  };
  double r0 = 0.0, h0 = above(0.0);
  double r1 = std::min(h0 / -ray.z(), kMaxRange_m), h1 = above(r1);
  for (int k = 0; k < 12 && std::abs(h1) > 1e-3; ++k) {
    const double next = std::clamp(r1 - h1 * (r1 - r0) / (h1 - h0), 0.5, 1.5 * kMaxRange_m);
    r0 = r1;
    h0 = h1;
    r1 = next;
    h1 = above(r1);
    if (!std::isfinite(h1) || h1 == h0) return kUnknown;
  }
  return std::abs(h1) < 5e-3 && r1 < kMaxRange_m ? r1 : kUnknown;
}

/// Range to an upright box in the frame of the street; infinite: none.
double box_range(const Box& box, double foot_z, const Vec3& from, const Vec3& ray) {
  const Vec3 low(box.low.x(), box.low.y(), foot_z - 1.0);
  const Vec3 high(box.high.x(), box.high.y(), foot_z + box.top_m);
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - from[axis]) / ray[axis];
    const double b = (high[axis] - from[axis]) / ray[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter < leave && enter > 0.0 ? enter : std::numeric_limits<double>::infinity();
}

Points scan_of(const GroundHeight& ground, const std::vector<Box>& boxes, const Pose& T_map_street,
               const Pose& T_map_vehicle, std::mt19937* rng) {
  constexpr int kRows = 48;
  constexpr int kCols = 720;
  std::normal_distribution<double> noise(0.0, kRangeNoise_m);
  const Vec3 from = T_map_vehicle * Vec3(0.0, 0.0, kLadar_m);
  const Pose T_street_map = T_map_street.inverse();
  std::vector<double> feet;
  for (const Box& b : boxes) {
    const Vec3 middle(0.5 * (b.low.x() + b.high.x()), 0.5 * (b.low.y() + b.high.y()), 0.0);
    const Vec3 at = T_map_street * middle;
    feet.push_back(ground(at.x(), at.y()));
  }
  Points scan;
  for (int row = 0; row < kRows; ++row) {
    // Denser near the horizon, as in a VLP-32.
    const double part = static_cast<double>(row) / (kRows - 1);
    const double up = radians(5.0 - 30.0 * part * part);
    for (int col = 0; col < kCols; ++col) {
      const double left = 2.0 * kPi * col / kCols;
      const Vec3 ray = T_map_vehicle.q * Vec3(std::cos(up) * std::cos(left),
                                              std::cos(up) * std::sin(left), std::sin(up));
      double range = ground_range(ground, from, ray);
      for (std::size_t k = 0; k < boxes.size(); ++k) {
        const double to_box =
            box_range(boxes[k], feet[k], T_street_map * from, T_street_map.q * ray);
        if (!(range <= to_box)) range = to_box;
      }
      if (!(range < kMaxRange_m)) continue;
      const Vec3 p = from + (range + noise(*rng)) * ray;
      scan.push_back((T_map_vehicle.inverse() * p).cast<float>());
    }
  }
  return scan;
}

double slopes_rms(const GroundHeight& ground, const Vec2& at) {
  constexpr double kStep_m = 2.0;
  double square = 0.0;
  int n = 0;
  for (double x = -20.0; x <= 20.0; x += kStep_m) {
    for (double y = -20.0; y <= 20.0; y += kStep_m) {
      const Vec2 p = at + Vec2(x, y);
      const double east = ground(p.x() + 1.0, p.y()) - ground(p.x() - 1.0, p.y());
      const double north = ground(p.x(), p.y() + 1.0) - ground(p.x(), p.y() - 1.0);
      const double s = 0.25 * (east * east + north * north);
      if (!std::isfinite(s)) continue;
      square += s;
      ++n;
    }
  }
  return n == 0 ? 0.0 : std::sqrt(square / n);
}

std::string with_slope(const std::string& name, const GroundHeight& ground, const Vec2& at) {
  return fmt::format("{} ({:.1f} deg)", name, degrees(std::atan(slopes_rms(ground, at))));
}

/// White noise of unit variance, through a Gaussian filter if it is correlated.
std::vector<float> unit_errors(int width, int height, double correlation_cells, std::mt19937* rng) {
  std::normal_distribution<float> normal;
  std::vector<float> e(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (float& v : e) v = normal(*rng);
  if (!(correlation_cells > 0.0)) return e;
  const int half = static_cast<int>(std::ceil(3.0 * correlation_cells));
  std::vector<float> kernel;
  double square = 0.0;
  for (int k = -half; k <= half; ++k) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * std::pow(k / correlation_cells, 2))));
    square += kernel.back() * kernel.back();
  }
  for (float& k : kernel) k /= static_cast<float>(std::sqrt(square));
  std::vector<float> out(e.size());
  for (const bool rows : {true, false}) {
    const int n = rows ? width : height;
    const int stride = rows ? 1 : width;
    for (int line = 0; line < (rows ? height : width); ++line) {
      const int first = rows ? line * width : line;
      for (int i = 0; i < n; ++i) {
        float sum = 0.0F;
        for (int k = -half; k <= half; ++k) {
          const int j = ((i + k) % n + n) % n;
          sum += kernel[static_cast<std::size_t>(k + half)] *
                 e[static_cast<std::size_t>(first + j * stride)];
        }
        out[static_cast<std::size_t>(first + i * stride)] = sum;
      }
    }
    e.swap(out);
  }
  return e;
}

}  // namespace

RasterPlace simulated_street(const StreetParams& params) {
  std::mt19937 rng(params.seed);
  const Street street = make_street(params, &rng);
  const std::vector<Box> boxes = make_boxes(street, &rng);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  RasterPlace place;
  place.name =
      fmt::format("street {:.1f} deg{}", degrees(params.slope_rad), params.kerbs ? ", kerbs" : "");
  place.ground = [street](double x, double y) { return street.height(x, y); };
  const Vec3 at = street.T_map_street * Vec3(2.0 * u(rng), -1.5 + 0.5 * u(rng), 0.0);
  place.T_map_vehicle =
      standing_on(place.ground, at.head<2>(), yaw_of(street.T_map_street.q) + 0.1 * u(rng));
  place.scan = scan_of(place.ground, boxes, street.T_map_street, place.T_map_vehicle, &rng);
  return place;
}

Result<RasterPlace> place_on_raster(const Raster& raster, std::uint32_t seed) {
  constexpr double kAround_m = 30.0;
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const auto smooth = std::make_shared<std::vector<float>>(raster.z_m);
  const auto z_at = [&](int i, int j) {
    return raster.z_m[static_cast<std::size_t>(j * raster.width + i)];
  };
  for (int j = 1; j + 1 < raster.height; ++j) {
    for (int i = 1; i + 1 < raster.width; ++i) {
      float sum = 0.0F;
      for (int dj = -1; dj <= 1; ++dj) {
        for (int di = -1; di <= 1; ++di) sum += z_at(i + di, j + dj);
      }
      (*smooth)[static_cast<std::size_t>(j * raster.width + i)] = sum / 9.0F;
    }
  }
  const double cell_m = raster.level.cell_m;
  RasterPlace place;
  place.ground = [smooth, cell_m, width = raster.width, height = raster.height](double x,
                                                                                double y) {
    const double a = x / cell_m + 0.5 * width - 0.5;
    const double b = y / cell_m + 0.5 * height - 0.5;
    if (!(a >= 0.0 && b >= 0.0 && a < width - 1 && b < height - 1)) return kUnknown;
    const int i = static_cast<int>(a);
    const int j = static_cast<int>(b);
    const double s = a - i;
    const double t = b - j;
    const float* z = smooth->data() + static_cast<std::ptrdiff_t>(j) * width + i;
    return (1 - t) * ((1 - s) * z[0] + s * z[1]) + t * ((1 - s) * z[width] + s * z[width + 1]);
  };
  for (int attempt = 0; attempt < 10000; ++attempt) {
    const Vec2 at = 0.5 * cell_m *
                    Vec2(raster.width * (2.0 * u(rng) - 1.0), raster.height * (2.0 * u(rng) - 1.0));
    int known = 0, all = 0;
    for (double x = -kAround_m; x <= kAround_m; x += 5.0) {
      for (double y = -kAround_m; y <= kAround_m; y += 5.0) {
        ++all;
        known += std::isnan(place.ground(at.x() + x, at.y() + y)) ? 0 : 1;
      }
    }
    const double here = place.ground(at.x() + 2.0, at.y()) + place.ground(at.x() - 2.0, at.y()) +
                        place.ground(at.x(), at.y() + 2.0) + place.ground(at.x(), at.y() - 2.0);
    if (std::isnan(here) || known < 0.5 * all) continue;
    place.T_map_vehicle = standing_on(place.ground, at, kPi * (2.0 * u(rng) - 1.0));
    place.scan = scan_of(place.ground, {}, Pose(), place.T_map_vehicle, &rng);
    place.name = with_slope("place on the raster", place.ground, at);
    return place;
  }
  return Error{"the raster has no place with known ground around it"};
}

Result<Survey> read_survey(const std::string& path, int class_column, double unit_m) {
  const auto file = clouds::open_survey_points(path, class_column);
  if (!file) return file.error();
  Survey survey;
  clouds::SurveyPoints block;
  while (true) {
    if (Outcome read = (*file)->next(&block); !read) return read.error();
    if (block.size() == 0) break;
    for (std::size_t k = 0; k < block.size(); ++k) {
      if (block.invalid[k] != 0) continue;
      const Vec3 p = unit_m * Vec3(block.x[k], block.y[k], block.z[k]);
      constexpr int kGround = 2;
      constexpr int kWater = 9;
      if (block.klass[k] == kGround) {
        survey.ground.push_back(p);
      } else if (block.klass[k] != kWater) {
        survey.vegetation.push_back(p);
      }
    }
  }
  if (survey.ground.empty()) return Error{path + ": no points of class 2 (ground)"};
  Vec3 low = survey.ground.front(), high = low;
  for (const Vec3& p : survey.ground) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3 centre = 0.5 * (low + high);
  for (Vec3& p : survey.ground) p -= centre;
  for (Vec3& p : survey.vegetation) p -= centre;
  return survey;
}

RasterPlace surveyed_place(const Survey& survey, std::uint32_t seed) {
  constexpr double kRange_m = 40.0;
  constexpr double kMargin_m = 45.0;
  constexpr std::size_t kNearest = 6;
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  struct Half {
    Points flat;
    std::vector<double> z;
    std::unique_ptr<KdTree> tree;
  };
  const auto half = std::make_shared<Half>();
  std::vector<Vec3> other;
  Vec3 low = survey.ground.front(), high = low;
  for (const Vec3& p : survey.ground) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    if (u(rng) < 0.5) {
      other.push_back(p);
      continue;
    }
    half->flat.push_back(Vec3(p.x(), p.y(), 0.0).cast<float>());
    half->z.push_back(p.z());
  }
  half->tree = std::make_unique<KdTree>(half->flat);
  RasterPlace place;
  place.ground = [half](double x, double y) {
    constexpr double kFarthest_m = 5.0;
    KdTree::Neighbours near;
    half->tree->nearest(Vec3(x, y, 0.0).cast<float>(), kNearest, &near);
    if (near.distance2_m2.front() > kFarthest_m * kFarthest_m) return kUnknown;
    Mat3 A = Vec3(1e-9, 1e-2, 1e-2).asDiagonal();
    Vec3 b = Vec3::Zero();
    for (std::size_t k = 0; k < near.index.size(); ++k) {
      const std::uint32_t i = near.index[k];
      const Vec3 t(1.0, half->flat.x[i] - x, half->flat.y[i] - y);
      const double w = 1.0 / (0.1 + near.distance2_m2[k]);
      A += w * t * t.transpose();
      b += w * half->z[i] * t;
    }
    return A.ldlt().solve(b)[0];
  };
  while (true) {
    const Vec2 at(low.x() + kMargin_m + u(rng) * (high.x() - low.x() - 2.0 * kMargin_m),
                  low.y() + kMargin_m + u(rng) * (high.y() - low.y() - 2.0 * kMargin_m));
    place.T_map_vehicle = standing_on(place.ground, at, 2.0 * kPi * u(rng));
    if (!place.T_map_vehicle.finite()) continue;
    place.scan = Points();
    const Pose T_vehicle_map = place.T_map_vehicle.inverse();
    std::size_t seen = 0;
    for (const std::vector<Vec3>* points : {&std::as_const(other), &survey.vegetation}) {
      for (const Vec3& p : *points) {
        if ((p.head<2>() - at).norm() > kRange_m) continue;
        place.scan.push_back((T_vehicle_map * p).cast<float>());
      }
      if (points == &std::as_const(other)) seen = place.scan.size();
    }
    constexpr std::size_t kEnough = 200;
    if (seen < kEnough) continue;  // a lake
    place.name = with_slope("survey", place.ground, at);
    return place;
  }
}

void add_errors(double sigma_m, double correlation_m, std::uint32_t seed, Raster* raster) {
  if (!(sigma_m > 0.0)) return;
  std::mt19937 rng(seed + 77U);
  const std::vector<float> e =
      unit_errors(raster->width, raster->height, correlation_m / raster->level.cell_m, &rng);
  for (std::size_t k = 0; k < e.size(); ++k) {
    raster->z_m[k] += static_cast<float>(sigma_m) * e[k];
  }
}

ElevationMap raster_map(const RasterPlace& place, const RasterErrors& errors) {
  Raster raster;
  raster.level.cell_m = errors.cell_m;
  const double half_m = errors.cell_m < 0.5 ? 80.0 : 140.0;
  const int half = static_cast<int>(half_m / errors.cell_m);
  // Not centred on a cell: the vehicle is anywhere on the lattice.
  const Cell middle = raster.level.cell_at(place.T_map_vehicle.p.x(), place.T_map_vehicle.p.y());
  raster.first = {middle.i - half, middle.j - half};
  raster.width = raster.height = 2 * half;
  raster.sigma_m = {static_cast<float>(errors.stated_m)};
  for (int j = 0; j < raster.height; ++j) {
    for (int i = 0; i < raster.width; ++i) {
      const Vec2 at = raster.level.centre({raster.first.i + i, raster.first.j + j});
      raster.z_m.push_back(static_cast<float>(place.ground(at.x(), at.y())));
    }
  }
  add_errors(errors.sigma_m, errors.correlation_m, errors.seed, &raster);
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  return std::move(ElevationMap::from_rasters(frame, mapping::with_coarser_levels(raster))).value();
}

}  // namespace rcs::test
