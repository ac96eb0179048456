#include "modules/sp/prior/raster_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "modules/registration/normal_equations.h"
#include "modules/sp/prior/prior_match.h"

namespace rcs::sp {
namespace {

constexpr double kRegion = 1.5;       // radius of the lattice in sigmas of the prediction
constexpr double kStep_m = 1.5;       // of the lattice
constexpr double kTurn_rad = 0.0436;  // of the lattice: 2.5 deg
constexpr std::size_t kCoarseCells = 200;
constexpr std::size_t kRefinedCells = 600;
constexpr std::size_t kCandidates = 5;
constexpr double kDistinct = 1.1;  // distance of two candidates, in steps of the lattice
constexpr int kCoarseSteps = 12;
constexpr int kFineSteps = 30;  // of each levelling
constexpr int kLevellings = 2;
constexpr WorkUnits kScanGroundCost = 20;  // of a point
// Sigma of the tilt in the end, in those of the prediction, which only regularizes the search.
constexpr double kFineTilt = 10.0;
constexpr double kCoarseEnd_m = 0.02;  // the last step of a candidate is smaller
constexpr double kFineEnd_m = 0.001;
constexpr double kBlock_m = 5.0;
constexpr double kBlockCells = 3.0;      // a block is at least as wide as this many cells
constexpr double kCoarsestCell_m = 4.0;  // a scan has too few blocks of a coarser map
constexpr double kSpread_m = 0.3;        // largest inflation of the residuals
constexpr double kMinSpread_m = 0.03;    // smallest one on the lattice
constexpr double kSame_m = 0.2;          // candidates that end closer are one
constexpr double kSame_rad = 0.01;
constexpr double kChiSquare95 = 5.991;  // 2 degrees of freedom
// Limits of a refusal. Another candidate outside of the ellipse must fit worse by this many
// standard deviations.
constexpr double kAdvantage = 3.0;
// The slopes of map and scan must have more in common than this many standard deviations.
constexpr double kWeakSlopes = 2.5;
constexpr double kMinGain = 3.0;   // sigma of the prediction over that of the match
constexpr double kFarthest = 2.0;  // from the prediction, in its sigmas

bool distinct(const RasterPose& a, const RasterPose& b, double away_m, double away_rad) {
  return (a.p_map - b.p_map).head<2>().norm() > away_m ||
         std::abs(wrap_angle(a.yaw_rad - b.yaw_rad)) > away_rad;
}

int lattice_half(double sigma, double step) {
  return static_cast<int>(std::ceil(kRegion * sigma / step));
}

double yaw_sigma(const registration::Prediction& prediction) {
  return std::sqrt(prediction.covariance(5, 5));
}

/// The lattice is fixed in the map: all predictions of a region give the same hypotheses, and
/// therefore the same result.
void make_hypotheses(const registration::Prediction& prediction, std::vector<RasterPose>* out) {
  const Vec3& p = prediction.T_target_vehicle.p;
  const double yaw = yaw_of(prediction.T_target_vehicle.q);
  const double radius_m = kRegion * horizontal_sigma(prediction);
  const int half = lattice_half(horizontal_sigma(prediction), kStep_m);
  const int turns = lattice_half(yaw_sigma(prediction), kTurn_rad);
  const int i0 = static_cast<int>(std::lround(p.x() / kStep_m));
  const int j0 = static_cast<int>(std::lround(p.y() / kStep_m));
  const int k0 = static_cast<int>(std::lround(yaw / kTurn_rad));
  out->clear();
  for (int j = j0 - half; j <= j0 + half; ++j) {
    for (int i = i0 - half; i <= i0 + half; ++i) {
      const Vec2 at = kStep_m * Vec2(i, j);
      if ((at - p.head<2>()).norm() > radius_m + 0.5 * kStep_m) continue;
      for (int k = k0 - turns; k <= k0 + turns; ++k) {
        RasterPose h;
        h.p_map = Vec3(at.x(), at.y(), 0.0);
        h.yaw_rad = wrap_angle(kTurn_rad * k);
        out->push_back(h);
      }
    }
  }
}

void take_evenly(const std::vector<ScanGroundCell>& cells, std::size_t most,
                 std::vector<ScanGroundCell>* out) {
  out->clear();
  const std::size_t n = std::min(most, cells.size());
  for (std::size_t k = 0; k < n; ++k) out->push_back(cells[k * cells.size() / n]);
}

Pose pose_of(const RasterPose& pose, const Mat3& R_level_vehicle) {
  const Quat q(Eigen::AngleAxisd(pose.yaw_rad, Vec3::UnitZ()));
  return {
      (exp_so3(Vec3(pose.tilt.y(), -pose.tilt.x(), 0.0)) * q * Quat(R_level_vehicle)).normalized(),
      pose.p_map};
}

/// Information of the pose, right perturbation.
Mat6 information_of(const Mat<7, 7>& covariance, const Mat3& R_map_vehicle) {
  // Rotation about the axes of the map: (tilt y, -tilt x, yaw).
  Mat6 S = Mat6::Zero();
  S.topLeftCorner<3, 3>() = Mat3::Identity();
  S(3, 5) = 1.0;
  S(4, 4) = -1.0;
  S(5, 3) = 1.0;
  Mat6 R = Mat6::Zero();
  R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = R_map_vehicle.transpose();
  const Mat6 of_pose = R * S * covariance.topLeftCorner<6, 6>() * S.transpose() * R.transpose();
  return of_pose.ldlt().solve(Mat6::Identity());
}

double rms_slope(const std::vector<ScanGroundCell>& cells) {
  double square = 0.0;
  for (const ScanGroundCell& cell : cells) square += cell.slope.squaredNorm();
  return std::sqrt(square / std::max(1.0, static_cast<double>(cells.size())));
}

bool better(const RasterPose& a, const RasterPose& b) {
  const auto key = [](const RasterPose& p) {
    return std::make_tuple(p.cost, p.p_map.x(), p.p_map.y(), p.yaw_rad);
  };
  return key(a) < key(b);
}

/// The best distinct hypotheses.
void choose_candidates(std::vector<RasterPose>* hypotheses, std::vector<RasterPose>* out) {
  std::sort(hypotheses->begin(), hypotheses->end(), better);
  out->clear();
  for (const RasterPose& h : *hypotheses) {
    if (out->size() == kCandidates || !std::isfinite(h.cost)) break;
    const bool fresh = std::all_of(out->begin(), out->end(), [&h](const RasterPose& other) {
      return distinct(h, other, kDistinct * kStep_m, kDistinct * kTurn_rad);
    });
    if (fresh) out->push_back(h);
  }
}

/// Refines the candidates; the best is the first one.
/// @return lookups of the map
WorkUnits refine_candidates(const RasterFit& fit, RasterSearchWorkspace* ws) {
  WorkUnits used = 0;
  take_evenly(ws->cells, kRefinedCells, &ws->sample);
  for (RasterPose& candidate : ws->candidates) {
    used += static_cast<WorkUnits>(ws->sample.size()) *
            converge(fit, ws->sample, kSpread_m, kCoarseSteps, kCoarseEnd_m, &candidate).taken;
    costs_by_block(fit, ws->cells, candidate, &ws->other_costs);
    used += static_cast<WorkUnits>(ws->cells.size());
    candidate.cost = std::accumulate(ws->other_costs.begin(), ws->other_costs.end(), 0.0);
  }
  std::sort(ws->candidates.begin(), ws->candidates.end(), better);
  return used;
}

/// The same pose for a scan that is levelled differently.
RasterPose levelled(const RasterPose& pose, const Mat3& R_level_vehicle,
                    const Mat3& R_other_vehicle) {
  const Mat3 R = pose_of(pose, R_level_vehicle).rotation() * R_other_vehicle.transpose();
  RasterPose out = pose;
  out.yaw_rad = yaw_of(Quat(R));
  const Vec3 turn =
      log_so3(Quat(Mat3(R * Eigen::AngleAxisd(-out.yaw_rad, Vec3::UnitZ()).toRotationMatrix())));
  out.tilt = Vec2(-turn.y(), turn.x());
  return out;
}

Mat3 level_of(const Pose& T_map_vehicle) {
  return Eigen::AngleAxisd(-yaw_of(T_map_vehicle.q), Vec3::UnitZ()).toRotationMatrix() *
         T_map_vehicle.rotation();
}

/// Refines the best candidate on all cells. The cells depend on the attitude: they are those of its
/// own, not of the start.
RasterSteps finish(const Points& source_vehicle, RasterFit fit, RasterSearchWorkspace* ws,
                   Mat3* R_level, registration::Registration* out) {
  fit.tilt_sigma_rad *= kFineTilt;
  RasterSteps steps;
  for (int k = 0; k < kLevellings; ++k) {
    const Mat3 R_own = level_of(pose_of(ws->candidates.front(), *R_level));
    for (RasterPose& c : ws->candidates) c = levelled(c, *R_level, R_own);
    *R_level = R_own;
    find_scan_ground(source_vehicle, *R_level, &ws->scan, &ws->cells);
    steps = converge(fit, ws->cells, 0.0, kFineSteps, kFineEnd_m, &ws->candidates.front());
    out->iterations += steps.taken;
    out->used += static_cast<WorkUnits>(ws->cells.size()) * steps.taken +
                 kScanGroundCost * static_cast<WorkUnits>(source_vehicle.size());
  }
  return steps;
}

/// Smallest advantage of the first candidate over another one outside of its 95 % ellipse;
/// infinite: there is none.
double min_advantage(const RasterFit& fit, const RasterAccuracy& accuracy,
                     RasterSearchWorkspace* ws) {
  double least = std::numeric_limits<double>::infinity();
  const RasterPose& best = ws->candidates.front();
  const Mat<2, 2> information = accuracy.covariance.topLeftCorner<2, 2>().inverse();
  costs_by_block(fit, ws->cells, best, &ws->block_costs);
  for (std::size_t k = 1; k < ws->candidates.size(); ++k) {
    const RasterPose& other = ws->candidates[k];
    if (!distinct(other, best, kSame_m, kSame_rad)) continue;
    const Vec2 off = (other.p_map - best.p_map).head<2>();
    if (off.dot(information * off) < kChiSquare95) continue;
    costs_by_block(fit, ws->cells, other, &ws->other_costs);
    least = std::min(least, advantage(ws->block_costs, ws->other_costs));
  }
  return least;
}

/// Whether the map determines no single position.
bool refused(const RasterFit& fit, const RasterAccuracy& accuracy,
             const registration::Prediction& prediction, RasterSearchWorkspace* ws) {
  if (!accuracy.valid || accuracy.slopes < kWeakSlopes) return true;
  const Eigen::SelfAdjointEigenSolver<Mat<2, 2>> axes(
      Mat<2, 2>(accuracy.covariance.topLeftCorner<2, 2>()));
  const double predicted = horizontal_sigma(prediction);
  const Vec2 off = (ws->candidates.front().p_map - prediction.T_target_vehicle.p).head<2>();
  if (kMinGain * std::sqrt(axes.eigenvalues()[1]) > predicted) return true;
  if (off.norm() > kFarthest * predicted) return true;
  return min_advantage(fit, accuracy, ws) < kAdvantage;
}

/// A refused match has information about the height alone, at the position of the prediction.
void keep_height(const RasterFit& fit, const registration::Prediction& prediction,
                 RasterSearchWorkspace* ws, registration::Registration* out) {
  out->stop = registration::Stop::kDegenerate;
  out->used += static_cast<WorkUnits>(ws->sample.size());
  RasterPose here;
  here.p_map = prediction.T_target_vehicle.p;
  here.yaw_rad = yaw_of(prediction.T_target_vehicle.q);
  evaluate(fit, ws->sample, kSpread_m, &ws->residuals, &here);
  if (!std::isfinite(here.cost)) return;
  out->T_target_vehicle.p.z() = here.p_map.z();
  const double of_slope_m = rms_slope(ws->sample) * horizontal_sigma(prediction);
  const double sigma_m =
      std::hypot(fit.params.min_sigma_m, kSpread_m * std::sqrt(here.cost)) + of_slope_m;
  const Vec3 up = prediction.T_target_vehicle.rotation().transpose() * Vec3::UnitZ();
  out->information.topLeftCorner<3, 3>() = up * up.transpose() / (sigma_m * sigma_m);
}

void describe(const RasterFit& fit, const std::vector<ScanGroundCell>& cells,
              const RasterPose& pose, registration::Registration* out) {
  const RasterResiduals residuals = residuals_of(fit, cells, pose);
  out->pairs = residuals.matched;
  out->mean_distance_m = residuals.mean_m;
  out->rms_m = residuals.rms_m;
  out->overlap = cells.empty() ? 0.0 : residuals.matched / static_cast<double>(cells.size());
  registration::NormalEquations equations;
  equations.H = out->information;
  equations.weight = out->information.topLeftCorner<3, 3>().trace();
  out->observability = registration::observability(equations, 0.0, 1e6).alignment.cwiseMin(1.0);
}

}  // namespace

double horizontal_sigma(const registration::Prediction& prediction) {
  const Mat3 R = prediction.T_target_vehicle.rotation();
  const Mat3 place = R * prediction.covariance.topLeftCorner<3, 3>() * R.transpose();
  return std::sqrt(std::max(place(0, 0), place(1, 1)));
}

bool raster_search_possible(const Points& source_vehicle, const ElevationMap& map, int level,
                            const registration::Prediction& prediction, WorkUnits granted) {
  if (map.level(level).cell_m > kCoarsestCell_m) return false;
  const auto n = static_cast<double>(source_vehicle.size());
  const double side = 2.0 * lattice_half(horizontal_sigma(prediction), kStep_m) + 1.0;
  const double turns = 2.0 * lattice_half(yaw_sigma(prediction), kTurn_rad) + 1.0;
  const double coarse = std::min<double>(kCoarseCells, n) * side * side * turns;
  const double refined = std::min<double>(kRefinedCells, n) * kCandidates * kCoarseSteps;
  const double fine = kLevellings * kFineSteps + 2.0 * kCandidates;
  const double ground = (kLevellings + 1.0) * kScanGroundCost;
  return coarse + refined + n * (fine + ground) <= static_cast<double>(granted);
}

registration::Registration search_raster(const Points& source_vehicle, const ElevationMap& map,
                                         int level, const registration::Prediction& prediction,
                                         const PriorMatchParams& params,
                                         RasterSearchWorkspace* ws) {
  registration::Registration out;
  out.T_target_vehicle = prediction.T_target_vehicle;
  out.points = static_cast<int>(source_vehicle.size());
  Mat3 R_level = level_of(prediction.T_target_vehicle);
  find_scan_ground(source_vehicle, R_level, &ws->scan, &ws->cells);
  const double cell_m = map.level(level).cell_m;
  const double share = std::max(1.0, cell_m / kScanGroundCell_m);
  const RasterFit fit{
      map,           level,
      params,        std::sqrt(std::max(prediction.covariance(3, 3), prediction.covariance(4, 4))),
      share * share, std::max(kBlock_m, kBlockCells * cell_m)};
  take_evenly(ws->cells, kCoarseCells, &ws->sample);
  const double spread_m =
      std::clamp(0.5 * kStep_m * rms_slope(ws->sample), kMinSpread_m, kSpread_m);
  make_hypotheses(prediction, &ws->hypotheses);
  for (RasterPose& h : ws->hypotheses) evaluate(fit, ws->sample, spread_m, &ws->residuals, &h);
  out.used += static_cast<WorkUnits>(ws->hypotheses.size() * ws->sample.size()) +
              kScanGroundCost * static_cast<WorkUnits>(source_vehicle.size());
  choose_candidates(&ws->hypotheses, &ws->candidates);
  if (ws->candidates.empty()) {
    out.stop = registration::Stop::kTooFew;
    return out;
  }
  out.used += refine_candidates(fit, ws);
  const RasterSteps steps = finish(source_vehicle, fit, ws, &R_level, &out);
  const RasterPose& best = ws->candidates.front();
  const RasterAccuracy accuracy = accuracy_of(fit, ws->cells, best, &ws->blocks);
  if (!steps.converged || refused(fit, accuracy, prediction, ws)) {
    keep_height(fit, prediction, ws, &out);
    return out;
  }
  out.stop = registration::Stop::kConverged;
  out.T_target_vehicle = pose_of(best, R_level);
  out.information = information_of(accuracy.covariance, out.T_target_vehicle.rotation());
  describe(fit, ws->cells, best, &out);
  const Vec6 correction = log_se3(prediction.T_target_vehicle.inverse() * out.T_target_vehicle);
  out.correction_m = correction.head<3>().norm();
  out.correction_rad = correction.tail<3>().norm();
  if (out.correction_m > params.max_correction_m ||
      out.correction_rad > params.max_correction_rad) {
    out.stop = registration::Stop::kDiverged;
    out.T_target_vehicle = prediction.T_target_vehicle;
    out.information.setZero();
  }
  return out;
}

}  // namespace rcs::sp
