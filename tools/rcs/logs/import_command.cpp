// rcs import, and rcs import kitti

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/log/log_file.h"
#include "tools/base/files.h"
#include "tools/base/trajectory.h"
#include "tools/importers/kitti_sweep.h"
#include "tools/rcs/command.h"
#include "tools/rcs/logs/mcap_commands.h"
#include "tools/rcs/terminal.h"
#include "tools/recording/log_bus.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

/// Numbers of the sweeps in a folder of %010d.bin, ascending. @return an error if there is a gap
Result<std::vector<int>> find_sweeps(const std::string& folder) {
  std::vector<int> numbers;
  std::error_code failed;
  for (const std::filesystem::directory_entry& entry :
       std::filesystem::directory_iterator(folder, failed)) {
    const std::string stem = entry.path().stem().string();
    if (entry.path().extension() != ".bin") continue;
    if (stem.size() != 10 || stem.find_first_not_of("0123456789") != std::string::npos) {
      return Error{fmt::format("{}: not named as a sweep, %010d.bin", entry.path().string())};
    }
    const std::int64_t number = std::stoll(stem);
    if (number > 1'000'000) {
      return Error{fmt::format("{}: sweep number above 1000000", entry.path().string())};
    }
    numbers.push_back(static_cast<int>(number));
  }
  if (failed) return Error{fmt::format("{}: {}", folder, failed.message())};
  if (numbers.empty()) {
    return Error{folder + ": no sweeps (%010d.bin); unpack the archive first"};
  }
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    if (numbers[i] != numbers[i - 1] + 1) {
      return Error{fmt::format("{}: sweeps {:010d} to {:010d} are missing", folder,
                               numbers[i - 1] + 1, numbers[i] - 1)};
    }
  }
  return numbers;
}

/// "LAT,LON,HEIGHT,ROLL,PITCH,YAW" in an OXTS packet's units: degrees, metres, radians.
Result<importers::OdomOrigin> parse_origin(const std::string& text) {
  const std::optional<std::vector<double>> v = tools::parse_numbers(text);
  if (!v || v->size() != 6) {
    return Error{"--origin: expected LAT,LON,HEIGHT,ROLL,PITCH,YAW [deg, deg, m, rad, rad, rad]"};
  }
  const importers::OdomOrigin origin = {
      {radians((*v)[0]), radians((*v)[1]), EllipsoidalHeight{(*v)[2]}}, (*v)[3], (*v)[4], (*v)[5]};
  if (!plausible(origin.place)) return Error{"--origin: not a valid geodetic position"};
  return origin;
}

class ImportKitti final : public Command {
 public:
  explicit ImportKitti(CLI::App* import)
      : Command(
            import->add_subcommand("kitti", "Import Velodyne sweeps and OXTS poses of KITTI raw")) {
    app()
        ->add_option("--scans", scans_,
                     "folder of %010d.bin, consecutive numbers, any first number")
        ->required()
        ->check(CLI::ExistingDirectory);
    app()
        ->add_option("--poses", poses_, "KITTI rows T_odom_imu; row i belongs to sweep i")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--calib", calib_, "folder with calib_imu_to_velo.txt")
        ->required()
        ->check(CLI::ExistingDirectory);
    app()->add_option("-o,--out", out_, "output log")->type_name("FILE")->required();
    app()
        ->add_option("--gps-sigma", gps_sigma_m_,
                     "sigma of the fixes per axis [m]: the accuracy of these poses")
        ->capture_default_str()
        ->check(CLI::Range(0.001, 100.0));
    app()
        ->add_option("--deskew", deskew_,
                     "none: all points of a sweep have the time of its middle, as in the\n"
                     "references for this data; azimuth: each point has its own time")
        ->capture_default_str()
        ->check(CLI::IsMember({"none", "azimuth"}));
    app()
        ->add_option("--rate", rate_hz_, "sweeps per second; the files have no stamps")
        ->capture_default_str()
        ->check(CLI::Range(1.0, 100.0));
    app()
        ->add_option("--origin", origin_,
                     "first OXTS packet [deg,deg,m,rad,rad,rad];\n"
                     "default: that of drive 2011_09_26_0005")
        ->type_name("LAT,LON,HEIGHT,ROLL,PITCH,YAW")
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Each sweep becomes 48 azimuth facets on LADAR_POINTS in the order of measurement,\n"
        "stamped with their ends; the reference instant is the middle of the sweep. The position\n"
        "of each pose becomes a GPS_FIX at that instant, without velocity. Sensor time starts at\n"
        "sweep 0.\n"
        "Example:\n"
        "  rcs import kitti --scans velodyne --poses oxts_imu_poses_kitti.txt --calib calib \\\n"
        "      -o kitti.log");
  }

  int run() override {
    const Result<std::vector<int>> sweeps = find_sweeps(scans_);
    if (!sweeps) return fail(kImportName, sweeps.error());
    const Result<importers::OdomOrigin> origin = parse_origin(origin_);
    if (!origin) return wrong_usage(kImportName, origin.error());
    const Result<std::string> poses_text = tools::read_text(poses_);
    if (!poses_text) return fail(kImportName, poses_text.error());
    const Result<std::vector<Pose>> poses = tools::parse_kitti(*poses_text, poses_);
    if (!poses) return fail(kImportName, poses.error());
    if (poses->size() <= static_cast<std::size_t>(sweeps->back())) {
      return fail(kImportName, {fmt::format("{}: {} rows, but the last sweep is number {}", poses_,
                                            poses->size(), sweeps->back())});
    }
    const std::string calib_file = calib_ + "/calib_imu_to_velo.txt";
    const Result<std::string> calib_text = tools::read_text(calib_file);
    if (!calib_text) return fail(kImportName, calib_text.error());
    const Result<Pose> T_vehicle_ladar = importers::parse_imu_to_velo(*calib_text, calib_file);
    if (!T_vehicle_ladar) return fail(kImportName, T_vehicle_ladar.error());

    tools::OutputFile out(out_);
    Counts counts;
    Outcome done = out.check();
    if (done) done = write_log(*sweeps, *poses, *origin, out.write_path(), &counts);
    if (done) done = out.commit();
    if (!done) return fail(kImportName, done.error());
    report(*sweeps, *T_vehicle_ladar, counts);
    return kExitOk;
  }

 private:
  static constexpr std::string_view kImportName = "import kitti";

  struct Counts {
    std::int64_t points = 0;
    std::int64_t not_finite = 0;
    std::int64_t no_return = 0;
    std::int64_t unorganized = 0;  ///< sweeps
    std::int64_t events = 0;
  };

  Outcome write_log(const std::vector<int>& sweeps, const std::vector<Pose>& T_odom_imu,
                    const importers::OdomOrigin& origin, const std::string& path,
                    Counts* counts) const {
    Result<LogWriter> writer = LogWriter::create(path);
    if (!writer) return writer.error();
    recording::LogBus bus(&writer.value());
    bus.set_publisher({id_of("kitti", static_cast<std::int64_t>(sweeps.size())), id_of("import")});
    Outbox<ladar_points_t> facets_out(&bus, channel::kLadarPoints);
    Outbox<gps_fix_t> fix_out(&bus, channel::kGpsFix);

    const InterruptGuard interrupt;
    Progress progress(kImportName, static_cast<std::int64_t>(sweeps.size()));
    for (const int number : sweeps) {
      if (interrupt.requested()) return Error{"interrupted"};
      progress.at(number - sweeps.front());
      importers::SweepTiming timing;
      timing.scan_id = number;
      timing.period = from_seconds(1.0 / rate_hz_);
      timing.start = Stamp() + number * timing.period;
      timing.point_times = deskew_ == "azimuth";

      const std::string file = fmt::format("{}/{:010d}.bin", scans_, number);
      const Result<std::vector<std::uint8_t>> bytes = tools::read_bytes(file);
      if (!bytes) return bytes.error();
      const Result<importers::Sweep> sweep = importers::parse_sweep(*bytes, file);
      if (!sweep) return sweep.error();
      Result<std::vector<ladar_points_t>> facets = importers::slice_sweep(*sweep, timing);
      if (!facets) return facets.error();

      const Stamp middle = timing.start + timing.period / 2;
      bool fix_due = true;
      for (ladar_points_t& facet : facets.value()) {
        const Stamp arrival = importers::facet_end(timing, facet.facet);
        if (fix_due && arrival >= middle) {
          gps_fix_t fix = importers::to_fix(T_odom_imu[static_cast<std::size_t>(number)], origin,
                                            middle, gps_sigma_m_);
          bus.at(middle);
          fix_out.publish(&fix);
          fix_due = false;
        }
        bus.at(arrival);
        facets_out.publish(&facet);
      }
      counts->points += static_cast<std::int64_t>(sweep->points_ladar.size());
      counts->not_finite += sweep->not_finite;
      counts->no_return += sweep->no_return;
      if (!sweep->organized()) ++counts->unorganized;
    }
    counts->events = writer->events();
    return writer->close();
  }

  void report(const std::vector<int>& sweeps, const Pose& T_vehicle_ladar,
              const Counts& counts) const {
    const Mat3 R = T_vehicle_ladar.rotation();  // = Rz(yaw) Ry(pitch) Rx(roll)
    const Vec3 rpy_deg(degrees(std::atan2(R(2, 1), R(2, 2))), degrees(-std::asin(R(2, 0))),
                       degrees(yaw_of(T_vehicle_ladar.q)));
    if (json_) {
      const report::Json json = {
          {"log", out_},
          {"sweeps", sweeps.size()},
          {"first_sweep", sweeps.front()},
          {"points", counts.points},
          {"points_not_finite", counts.not_finite},
          {"points_without_return", counts.no_return},
          {"sweeps_not_organized", counts.unorganized},
          {"events", counts.events},
          {"mount_m", {T_vehicle_ladar.p.x(), T_vehicle_ladar.p.y(), T_vehicle_ladar.p.z()}},
          {"mount_rpy_deg", {rpy_deg.x(), rpy_deg.y(), rpy_deg.z()}}};
      fmt::print("{}", report::json_document(kImportName, json));
      return;
    }
    fmt::print(stderr,
               "{}: {} sweeps from number {}, {} points ({} not finite and {} without return "
               "dropped), {} sweeps not organized\n"
               "mount of the LADAR in the vehicle by the calibration: m [{:.6f}, {:.6f}, {:.6f}], "
               "rpy_deg [{:.6f}, {:.6f}, {:.6f}]\n",
               out_, sweeps.size(), sweeps.front(), counts.points, counts.not_finite,
               counts.no_return, counts.unorganized, T_vehicle_ladar.p.x(), T_vehicle_ladar.p.y(),
               T_vehicle_ladar.p.z(), rpy_deg.x(), rpy_deg.y(), rpy_deg.z());
  }

  std::string scans_;
  std::string poses_;
  std::string calib_;
  std::string out_;
  std::string deskew_ = "none";
  std::string origin_ =
      "49.011212804408,8.4228850417969,112.83492279053,0.022447,0.00001,-1.2219096732051";
  double gps_sigma_m_ = 0.5;
  double rate_hz_ = 9.6525;  // 0.1036 s a sweep
  bool json_ = false;
};

}  // namespace

void add_import_commands(CLI::App* rcs, Commands* commands) {
  CLI::App* import =
      rcs->add_subcommand("import", "Convert other recordings to logs of this system");
  import->require_subcommand(1);
  commands->push_back(std::make_unique<ImportKitti>(import));
  add_recording_imports(import, commands);
  add_import_mcap_command(import, commands);
}

}  // namespace rcs::cli
