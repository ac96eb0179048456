// rcs map match

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "modules/sp/prior/prior_scan.h"
#include "tools/base/trajectory.h"
#include "tools/clouds/cloud_file.h"
#include "tools/rcs/command.h"
#include "tools/rcs/maps/map_memory.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/studies/match_starts.h"

namespace rcs::cli {
namespace {

using report::Json;

constexpr std::string_view kMapMatchName = "map match";

class MapMatch final : public Command {
 public:
  explicit MapMatch(CLI::App* map)
      : Command(map->add_subcommand("match",
                                    "Match a scan to a map from random starts and measure "
                                    "the convergence")) {
    app()->add_option("MAP", map_, "folder of the map")->type_name("FOLDER")->required();
    app()
        ->add_option("CLOUD", cloud_, "scan in the vehicle frame: .pcd, .ply, .bin or .xyz [m]")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--pose", pose_,
                     "approximate pose of the vehicle in the frame of the map [m; quaternion]")
        ->type_name("TX,TY,TZ,QX,QY,QZ,QW")
        ->required();
    app()
        ->add_option("--starts", starts_, "number of random starts around the pose")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app()
        ->add_option("--max-start-distance", max_start_distance_m_,
                     "maximum distance of the starts from the pose [m]")
        ->check(CLI::Range(0.0, 100.0))
        ->capture_default_str();
    app()
        ->add_option("--max-start-heading-error", max_start_heading_error_deg_,
                     "maximum heading error of the starts [deg]")
        ->check(CLI::Range(0.0, 45.0))
        ->capture_default_str();
    app()->add_option("--seed", seed_, "seed of the starts")->capture_default_str();
    app()
        ->add_option("--column", column_m_,
                     "side of the columns [m]; the lowest point of each is matched")
        ->check(CLI::Range(0.05, 50.0))
        ->capture_default_str();
    app()
        ->add_option("--max-range", max_range_m_, "maximum range of the points [m]")
        ->check(CLI::Range(1.0, 1000.0))
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "Exit status 1 if fewer than 95 % of the starts converge within 0.1 m of their median.\n"
        "Example:\n"
        "  rcs map match maps/street sweep.bin --pose "
        "5172.7,2419.1,66.9,0.003,-0.014,-0.241,0.970");
  }

  int run() override {
    const Result<ElevationMap> map = ElevationMap::load(map_, kMapMemory_bytes);
    if (!map) return fail(kMapMatchName, map.error());
    const Result<clouds::Cloud> cloud = clouds::read_cloud(cloud_, {});
    if (!cloud) return fail(kMapMatchName, cloud.error());
    if (const std::string skipped = clouds::skipped_text(*cloud); !skipped.empty()) {
      fmt::print(stderr, "rcs map match: {}: {}\n", cloud_, skipped);
    }
    const std::optional<std::vector<double>> v = tools::parse_numbers(pose_);
    if (!v || v->size() != 7)
      return wrong_usage(kMapMatchName, Error{"--pose: expected 7 numbers"});
    const Quat q((*v)[6], (*v)[3], (*v)[4], (*v)[5]);
    if (std::abs(q.norm() - 1.0) > 1e-3) {
      return wrong_usage(kMapMatchName, Error{"--pose: the norm of the quaternion is not 1"});
    }
    const Pose given{q.normalized(), Vec3((*v)[0], (*v)[1], (*v)[2])};
    Points near;
    for (std::size_t i = 0; i < cloud->points.size(); ++i) {
      if (cloud->points[i].norm() <= max_range_m_) near.push_back(cloud->points[i]);
    }
    sp::PriorScanParams as_sp;
    as_sp.column_m = column_m_;
    const int max_standing = map->has_points() ? sp::PriorMatchParams().points.max_points : 0;
    sp::PriorScan scan;
    scan.take(near, given.q.conjugate() * Vec3::UnitZ(), max_standing, as_sp);
    const studies::MatchEnds ends = match_all(scan, *map, given);
    if (ends.poses.empty()) {
      const Json json = {{"points", scan.ground().size()},
                         {"starts", starts_},
                         {"without_valid_match", ends.refused},
                         {"converged", 0},
                         {"iterations_mean", ends.iterations}};
      if (json_) fmt::print("{}", report::json_document(kMapMatchName, json));
      return negative(kMapMatchName,
                      Error{fmt::format("none of {} starts gave a valid match", starts_)});
    }
    return print_results(ends, given, static_cast<int>(scan.ground().size()));
  }

 private:
  [[nodiscard]] studies::MatchEnds match_all(const sp::PriorScan& scan, const ElevationMap& map,
                                             const Pose& given) const {
    sp::PriorMatchParams params;
    params.max_iterations = 60;
    Progress progress(kMapMatchName, starts_);
    return studies::match_from_starts(
        scan, map, given,
        {starts_, max_start_distance_m_, radians(max_start_heading_error_deg_), seed_}, params,
        [&progress](int k) { progress.at(k); });
  }

  [[nodiscard]] int print_results(const studies::MatchEnds& ends, const Pose& given,
                                  int points) const {
    const Pose& end = ends.poses[ends.nearest];
    const Eigen::Matrix2d plane = ends.plane();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(plane);
    const double k95 = std::sqrt(5.991);  // chi-square of 2 degrees of freedom
    const Vec2 offset = end.p.head<2>() - given.p.head<2>();
    const Vec3 turn = log_so3(given.q.conjugate() * end.q);
    const Vec2 along = axes.eigenvectors().col(1);
    const Json json = {
        {"points", points},
        {"starts", starts_},
        {"without_valid_match", ends.refused},
        {"converged", ends.converged},
        {"iterations_mean", ends.iterations},
        {"pose_tum", {end.p.x(), end.p.y(), end.p.z(), end.q.x(), end.q.y(), end.q.z(), end.q.w()}},
        {"offset_from_given",
         {{"east_m", offset.x()},
          {"north_m", offset.y()},
          {"up_m", end.p.z() - given.p.z()},
          {"roll_deg", degrees(turn.x())},
          {"pitch_deg", degrees(turn.y())},
          {"yaw_deg", degrees(turn.z())}}},
        {"ellipse95",
         {{"major_m", k95 * std::sqrt(axes.eigenvalues()[1])},
          {"minor_m", k95 * std::sqrt(axes.eigenvalues()[0])},
          {"major_axis_deg_from_east", degrees(std::atan2(along.y(), along.x()))},
          {"given_pose_inside", ends.inside(given.p.head<2>())}}}};
    if (json_) {
      fmt::print("{}", report::json_document(kMapMatchName, json));
    } else {
      const Json& o = json["offset_from_given"];
      const Json& e = json["ellipse95"];
      fmt::print("{} of {} starts converge within {} m of the median ({} without a valid match)\n",
                 ends.converged, starts_, studies::MatchEnds::kSamePlace_m, ends.refused);
      fmt::print(
          "result: tx ty tz qx qy qz qw = {:.3f} {:.3f} {:.3f} {:.6f} {:.6f} {:.6f} {:.6f}\n",
          end.p.x(), end.p.y(), end.p.z(), end.q.x(), end.q.y(), end.q.z(), end.q.w());
      fmt::print(
          "relative to the given pose: east {:.3f} m, north {:.3f} m, up {:.3f} m; roll {:.3f}, "
          "pitch {:.3f}, yaw {:.3f} deg\n",
          offset.x(), offset.y(), o["up_m"].get<double>(), o["roll_deg"].get<double>(),
          o["pitch_deg"].get<double>(), o["yaw_deg"].get<double>());
      fmt::print(
          "95 % ellipse: {:.3f} x {:.3f} m, major axis {:.0f} deg from east; the given pose is {} "
          "it\n",
          e["major_m"].get<double>(), e["minor_m"].get<double>(),
          e["major_axis_deg_from_east"].get<double>(),
          e["given_pose_inside"].get<bool>() ? "inside" : "outside");
    }
    return ends.converged * 100 >= starts_ * 95 ? kExitOk : kExitNegative;
  }

  std::string map_;
  std::string cloud_;
  std::string pose_;
  int starts_ = 100;
  double max_start_distance_m_ = 3.0;
  double max_start_heading_error_deg_ = 5.0;
  std::uint64_t seed_ = 1;
  double column_m_ = 0.5;
  double max_range_m_ = 80.0;
  bool json_ = false;
};

}  // namespace

void add_map_match_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapMatch>(map));
}

}  // namespace rcs::cli
