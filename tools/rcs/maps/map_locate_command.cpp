// rcs map locate

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/maps/map_memory.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/studies/locate_run.h"

namespace rcs::cli {
namespace {

using report::Json;

constexpr std::string_view kMapLocateName = "map locate";
constexpr Duration kMaxTruthGap = std::chrono::milliseconds(250);
// A result with a larger error than this is false.
constexpr double kFalse_m = 5.0;
constexpr double kFalse_rad = 3.0 * kPi / 180.0;

constexpr std::string_view kReasons[] = {"found",
                                         "too little terrain observed",
                                         "the region is not in the map",
                                         "no pose in the region matches the terrain",
                                         "the terrain has too little relief",
                                         "several candidate poses match equally well",
                                         "new terrain did not confirm the candidate pose"};

/// Heading of a compass: clockwise from north.
double yaw_of_heading(double heading_deg) { return wrap_angle(radians(90.0 - heading_deg)); }
double heading_of_yaw(double yaw_rad) {
  const double heading_deg = std::fmod(90.0 - degrees(yaw_rad) + 720.0, 360.0);
  return heading_deg;
}

class MapLocate final : public Command {
 public:
  explicit MapLocate(CLI::App* map)
      : Command(map->add_subcommand("locate",
                                    "Search the start of a drive without GPS on a map (initial "
                                    "localization)")) {
    app()->add_option("MAP", map_, "folder of the map")->type_name("FOLDER")->required();
    app()
        ->add_option("LOG", log_,
                     "log with SP_POINTS and WM_NAV_STATE: of a live run or of rcs replay")
        ->required()
        ->check(CLI::ExistingFile);
    CLI::Option* near = add_numbers(app(), "--near", &near_m_, "EAST,NORTH", -1e7, 1e7,
                                    "centre of the search region [m] in the frame of the map");
    app()
        ->add_option("--within", within_m_, "radius of the search region [m]")
        ->check(CLI::Range(1.0, 1000.0))
        ->capture_default_str();
    CLI::Option* heading = app()
                               ->add_option("--heading", heading_deg_,
                                            "approximate heading at the start [deg], clockwise "
                                            "from north")
                               ->check(CLI::Range(-360.0, 360.0));
    app()
        ->add_option("--heading-within", heading_within_deg_, "maximum error of --heading [deg]")
        ->check(CLI::Range(0.5, 180.0))
        ->capture_default_str();
    app()
        ->add_option("--from", from_s_,
                     "start of the search, time after the begin of the drive [s]")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app()
        ->add_option("--for", length_s_, "duration of the search [s]")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app()
        ->add_option("--starts", starts_,
                     "instead of --near and --heading: number of searches, evenly over the drive, "
                     "each in a random region around SIM_TRUTH")
        ->check(CLI::Range(1, 100000))
        ->excludes(near)
        ->excludes(heading);
    app()->add_option("--seed", seed_, "seed of the regions of --starts")->capture_default_str();
    add_numbers(app(), "--start-distance", &start_distance_m_, "MIN,MAX", 0.0, 1000.0,
                "--starts: distance of the centres of the regions from SIM_TRUTH [m]; default: 0 "
                "and --within");
    app()
        ->add_option("--units", units_, "work units granted per scan")
        ->check(CLI::Range(std::int64_t{10000}, std::int64_t{1} << 40))
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "Exit status 1 if the start is not found; with --starts if any result is false: an error\n"
        "of more than 5 m or 3 deg against SIM_TRUTH.\n"
        "Example:\n"
        "  rcs replay config/demo3.toml drive.log -o run.log --without GPS_FIX\n"
        "  rcs map locate maps/valley run.log --near 120,-40 --within 100 --heading 70 "
        "--heading-within 20");
  }

  int run() override {
    if (starts_ == 0 && (near_m_.empty() || std::isnan(heading_deg_))) {
      fmt::print(stderr, "rcs {}: --near and --heading, or --starts, are required\n",
                 kMapLocateName);
      return kExitUsage;
    }
    const Result<ElevationMap> map = ElevationMap::load(map_, kMapMemory_bytes);
    if (!map) return fail(kMapLocateName, map.error());
    const Result<studies::SeenDrive> drive = studies::read_drive(log_, kColumn_m);
    if (!drive) return fail(kMapLocateName, drive.error());
    Pose T_map_truth;
    if (drive->truth_datum) {
      T_map_truth = LocalFrame(map->datum()).from(LocalFrame(*drive->truth_datum));
    }
    if (starts_ == 0) return one(*map, *drive, T_map_truth);
    if (!drive->truth_datum) {
      return fail(kMapLocateName, Error{log_ + ": no SIM_TRUTH, which --starts requires"});
    }
    return many(*map, *drive, T_map_truth);
  }

 private:
  static constexpr double kColumn_m = 1.0;

  [[nodiscard]] std::size_t scan_after(const studies::SeenDrive& drive, double from_s) const {
    std::size_t first = 0;
    while (first + 1 < drive.scans.size() &&
           drive.scans[first].stamp - drive.scans[0].stamp < from_seconds(from_s)) {
      ++first;
    }
    return first;
  }

  [[nodiscard]] Json result_of(const studies::LocateResult& r, const studies::SeenDrive& drive,
                               const Pose& T_map_truth) const {
    const sp::InitialLocalizationStatus& s = r.status;
    const bool found = s.state == sp::InitialLocalizationState::kFound;
    Json json = {{"found", found},
                 {"reason", kReasons[static_cast<std::size_t>(s.reason)]},
                 {"after_s", r.after_s},
                 {"travelled_m", s.travelled_m},
                 {"searches", s.searches},
                 {"rejected", s.refuted},
                 {"hypotheses", s.hypotheses},
                 {"scatter_m", s.scatter_m},
                 {"cost", s.cost},
                 {"evidence", s.evidence},
                 {"margin", std::isfinite(s.margin) ? Json(s.margin) : Json(nullptr)},
                 {"work_units", r.used}};
    if (s.searches > 0) {
      json["best"] = {{"east_m", r.T_map_vehicle.p.x()},
                      {"north_m", r.T_map_vehicle.p.y()},
                      {"up_m", r.T_map_vehicle.p.z()},
                      {"heading_deg", heading_of_yaw(yaw_of(r.T_map_vehicle.q))},
                      {"sigma_east_m", std::sqrt(r.covariance(0, 0))},
                      {"sigma_north_m", std::sqrt(r.covariance(1, 1))},
                      {"sigma_up_m", std::sqrt(r.covariance(2, 2))},
                      {"sigma_heading_deg", degrees(std::sqrt(r.covariance(3, 3)))}};
      if (const std::optional<Pose> truth = tools::pose_at(drive.truth, r.stamp, kMaxTruthGap)) {
        const Pose T = T_map_truth * *truth;
        const Vec3 off = r.T_map_vehicle.p - T.p;
        const double turned = wrap_angle(yaw_of(r.T_map_vehicle.q) - yaw_of(T.q));
        json["error"] = {{"horizontal_m", off.head<2>().norm()},
                         {"up_m", off.z()},
                         {"heading_deg", degrees(turned)},
                         {"nees_horizontal",
                          off.head<2>().dot(Mat<2>(r.covariance.topLeftCorner<2, 2>()).inverse() *
                                            off.head<2>())}};
        json["false"] = found && (off.head<2>().norm() > kFalse_m || std::abs(turned) > kFalse_rad);
      }
    }
    return json;
  }

  [[nodiscard]] int one(const ElevationMap& map, const studies::SeenDrive& drive,
                        const Pose& T_map_truth) {
    sp::InitialLocalizer localizer(params_);
    const sp::StartRegion region{{near_m_[0], near_m_[1]},
                                 within_m_,
                                 yaw_of_heading(heading_deg_),
                                 radians(heading_within_deg_)};
    const InterruptGuard interrupt;
    const studies::LocateResult r = [&] {
      Progress progress(kMapLocateName, Progress::kSteps);
      return studies::locate(drive, scan_after(drive, from_s_), from_seconds(length_s_), map,
                             region, units_, &localizer, [&](double share) {
                               progress.at_share(share);
                               return !interrupt.requested();
                             });
    }();
    if (interrupt.requested()) return fail(kMapLocateName, Error{"interrupted"});
    if (r.status.state == sp::InitialLocalizationState::kOff) return refuse();
    const Json json = result_of(r, drive, T_map_truth);
    if (json_) {
      print_json(Json::array({json}));
    } else {
      print(json);
    }
    return json["found"].get<bool>() ? kExitOk : kExitNegative;
  }

  [[nodiscard]] int refuse() const {
    return wrong_usage(kMapLocateName,
                       Error{fmt::format("--within {} m and --heading-within {} deg require more "
                                         "than {} hypotheses",
                                         within_m_, heading_within_deg_, params_.hypotheses)});
  }

  static void print_json(const Json& results) {
    int found = 0;
    int wrong = 0;
    for (const Json& r : results) {
      found += r["found"].get<bool>() ? 1 : 0;
      wrong += r.value("false", false) ? 1 : 0;
    }
    const Json json = {
        {"searches", results.size()}, {"found", found}, {"false", wrong}, {"results", results}};
    fmt::print("{}", report::json_document(kMapLocateName, json));
  }

  static void print(const Json& json) {
    if (json["found"].get<bool>()) {
      fmt::print("found after {:.1f} s and {:.0f} m\n", json["after_s"].get<double>(),
                 json["travelled_m"].get<double>());
    } else {
      fmt::print("not found in {:.1f} s and {:.0f} m: {}\n", json["after_s"].get<double>(),
                 json["travelled_m"].get<double>(), json["reason"].get<std::string>());
      const int left = json["hypotheses"].get<int>();
      fmt::print("{}{} searches, {} candidates rejected\n",
                 left == 0 ? std::string()
                           : fmt::format("{} hypotheses left, {:.1f} m apart (RMS); ", left,
                                         json["scatter_m"].get<double>()),
                 json["searches"].get<int>(), json["rejected"].get<int>());
      if (left == 0) return;
    }
    if (!json.contains("best")) return;
    const Json& b = json["best"];
    fmt::print(
        "{}: east {:.2f} m, north {:.2f} m, up {:.2f} m, heading {:.2f} deg\n"
        "  sigma: east {:.2f} m, north {:.2f} m, up {:.2f} m, heading {:.2f} deg\n",
        json["found"].get<bool>() ? "pose of the vehicle" : "best candidate (not confirmed)",
        b["east_m"].get<double>(), b["north_m"].get<double>(), b["up_m"].get<double>(),
        b["heading_deg"].get<double>(), b["sigma_east_m"].get<double>(),
        b["sigma_north_m"].get<double>(), b["sigma_up_m"].get<double>(),
        b["sigma_heading_deg"].get<double>());
    if (!json.contains("error")) return;
    const Json& e = json["error"];
    fmt::print("error against the truth: {:.2f} m, up {:.2f} m, heading {:.2f} deg\n",
               e["horizontal_m"].get<double>(), e["up_m"].get<double>(),
               e["heading_deg"].get<double>());
  }

  [[nodiscard]] int many(const ElevationMap& map, const studies::SeenDrive& drive,
                         const Pose& T_map_truth) {
    std::mt19937_64 rng(seed_);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const double min_m = start_distance_m_.empty() ? 0.0 : start_distance_m_[0];
    const double max_m = start_distance_m_.empty() ? within_m_ : start_distance_m_[1];
    const double drive_s = seconds(drive.scans.back().stamp - drive.scans.front().stamp);
    const double last_s = std::max(0.0, drive_s - length_s_);
    sp::InitialLocalizer localizer(params_);
    const InterruptGuard interrupt;
    Progress progress(kMapLocateName, Progress::kSteps);
    Json all = Json::array();
    int found = 0;
    int wrong = 0;
    for (int k = 0; k < starts_; ++k) {
      if (interrupt.requested()) return fail(kMapLocateName, Error{"interrupted"});
      const double from_s = starts_ > 1 ? last_s * k / (starts_ - 1) : from_s_;
      const std::size_t first = scan_after(drive, from_s);
      const std::optional<Pose> truth =
          tools::pose_at(drive.truth, drive.scans[first].stamp, kMaxTruthGap);
      if (!truth) return fail(kMapLocateName, Error{"SIM_TRUTH does not cover the drive"});
      const Pose T = T_map_truth * *truth;
      const double bearing = 2.0 * kPi * uniform(rng);
      // Uniform over the ring.
      const double off_m =
          std::sqrt(min_m * min_m + uniform(rng) * (max_m * max_m - min_m * min_m));
      const double turned = radians(heading_within_deg_) * (2.0 * uniform(rng) - 1.0);
      const sp::StartRegion region{
          T.p.head<2>() + off_m * Vec2(std::cos(bearing), std::sin(bearing)), within_m_,
          wrap_angle(yaw_of(T.q) + turned), radians(heading_within_deg_)};
      const studies::LocateResult r =
          studies::locate(drive, first, from_seconds(length_s_), map, region, units_, &localizer,
                          [&](double share) {
                            progress.at_share((k + share) / starts_);
                            return !interrupt.requested();
                          });
      if (r.status.state == sp::InitialLocalizationState::kOff) return refuse();
      Json json = result_of(r, drive, T_map_truth);
      json["from_s"] = from_s;
      json["offset_m"] = off_m;
      json["heading_offset_deg"] = degrees(turned);
      found += json["found"].get<bool>() ? 1 : 0;
      wrong += json.value("false", false) ? 1 : 0;
      all.push_back(json);
    }
    if (json_) {
      print_json(all);
    } else {
      print_all(all);
      fmt::print("{} of {} starts found, {} of them false\n", found, starts_, wrong);
    }
    return wrong == 0 ? kExitOk : kExitNegative;
  }

  static void print_all(const Json& all) {
    for (const Json& t : all) {
      fmt::print("{:5.1f} s, offset {:5.1f} m {:5.1f} deg: ", t["from_s"].get<double>(),
                 t["offset_m"].get<double>(), t["heading_offset_deg"].get<double>());
      if (t["found"].get<bool>()) {
        fmt::print("found after {:.1f} s, error {:.2f} m and {:.2f} deg\n",
                   t["after_s"].get<double>(), t["error"]["horizontal_m"].get<double>(),
                   t["error"]["heading_deg"].get<double>());
      } else {
        fmt::print("not found: {} ({} left)\n", t["reason"].get<std::string>(),
                   t["hypotheses"].get<int>());
      }
    }
  }

  std::string map_;
  std::string log_;
  std::vector<double> near_m_;
  double within_m_ = 100.0;
  double heading_deg_ = std::numeric_limits<double>::quiet_NaN();
  double heading_within_deg_ = 20.0;
  double from_s_ = 0.0;
  double length_s_ = 60.0;
  int starts_ = 0;
  std::uint64_t seed_ = 1;
  std::vector<double> start_distance_m_;
  WorkUnits units_ = sp::InitialLocalizationParams{}.units;
  bool json_ = false;
  sp::InitialLocalizationParams params_;
};

}  // namespace

void add_map_locate_command(CLI::App* map, Commands* commands) {
  commands->push_back(std::make_unique<MapLocate>(map));
}

}  // namespace rcs::cli
