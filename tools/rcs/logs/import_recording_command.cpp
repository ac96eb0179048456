// rcs import comma2k19, rcs import imu-gps

#include <fmt/format.h>

#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/importers/comma2k19.h"
#include "tools/importers/imu_gps_import.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

using report::Json;

Json to_json(const importers::RowCounts& c) {
  return {{"rows", c.rows},
          {"written", c.written},
          {"missing", c.missing},
          {"backward", c.backward},
          {"gaps", c.gaps},
          {"unpaired", c.unpaired},
          {"unchanged", c.unchanged},
          {"no_fix", c.no_fix},
          {"implausible", c.implausible},
          {"without_velocity", c.without_velocity},
          {"clock_steps", c.clock_steps}};
}

/// One line; counts of zero are omitted, except for missing cells and stamps.
std::string to_text(std::string_view sensor, const importers::RowCounts& c) {
  std::string text = fmt::format(
      "{}: {} of {} rows; skipped for missing cells: {}; stamps not after the newest: {}", sensor,
      c.written, c.rows, c.missing, c.backward);
  const auto append = [&text](std::string_view what, std::int64_t n) {
    if (n > 0) text += fmt::format("; {}: {}", what, n);
  };
  append("gaps not bridged", c.gaps);
  append("skipped without a matching row in the other file", c.unpaired);
  append("skipped as repeated fixes", c.unchanged);
  append("skipped without a fix", c.no_fix);
  append("skipped for an invalid position or sigma 0", c.implausible);
  append("without speed or course", c.without_velocity);
  append("steps of the receiver's clock", c.clock_steps);
  return text + "\n";
}

void add_counts(const importers::ImportCounts& counts, Json* json, std::string* text) {
  const auto add = [&](const char* sensor, const std::optional<importers::RowCounts>& c) {
    if (!c) return;
    (*json)[sensor] = to_json(*c);
    *text += to_text(sensor, *c);
  };
  add("INS", counts.imu);
  add("GPS_FIX", counts.gps);
  add("ODOMETRY", counts.wheels);
}

Outcome write_whole(const recording::SensorLog& log, const std::string& path) {
  if (log.events().empty()) return Error{"no valid row: nothing is written"};
  tools::OutputFile out(path);
  Outcome done = out.check();
  if (done) done = log.write(out.write_path());
  return done ? out.commit() : done;
}

void print_result(std::string_view command, bool as_json, const Json& json,
                  const std::string& text) {
  if (as_json) {
    fmt::print("{}", report::json_document(command, json));
  } else {
    fmt::print(stderr, "{}", text);
  }
}

class ImportComma final : public Command {
 public:
  explicit ImportComma(CLI::App* import)
      : Command(import->add_subcommand("comma2k19", "Import one minute of comma2k19 (CSV)")) {
    app()
        ->add_option("FOLDER", folder_,
                     "folder with imu_acc.csv, imu_gyro.csv, gnss_ublox.csv, can_wheel_speed.csv\n"
                     "and truth_pose.csv")
        ->required()
        ->check(CLI::ExistingDirectory);
    app()->add_option("-o,--out", out_, "output log")->type_name("FILE")->required();
    app()
        ->add_option(
            "--gps-latency", setup_.gps_latency_s,
            "time from the instant of a fix to its arrival at the device [s]; with receiver\n"
            "stamps: in addition to the minimum observed delay. Default: measured on the\n"
            "first 20 s of Example_1")
        ->capture_default_str()
        ->check(CLI::Range(-1.0, 5.0));
    app()
        ->add_option(
            "--gps-stamps", stamps_,
            "receiver: utc_ms, mapped to the clock of the device by the messages with the\n"
            "minimum delay; arrival: time of arrival at the device")
        ->capture_default_str()
        ->check(CLI::IsMember({"receiver", "arrival"}));
    app()
        ->add_option("--gps-sigma", setup_.gps_sigma_m,
                     "sigma of the fixes, east and north [m]; up: 1.5 times this. The files have\n"
                     "none; the data sheet of an M8 receiver specifies 2.0 m CEP with SBAS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 100.0));
    add_numbers(app(), "--mount-rpy-deg", &mount_rpy_deg_, "ROLL,PITCH,YAW", -180.0, 180.0,
                "mount of the device: R = Rz(yaw) Ry(pitch) Rx(roll) [deg]. Default:\n"
                "measured on the first 20 s of Example_1 (3.68 down, 0.85 left)");
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Writes INS (increments in vehicle axes), GPS_FIX (no measured vertical velocity: 0 with "
        "a\n"
        "sigma of a fifth of the speed), ODOMETRY (mean of the rear wheels) and SIM_TRUTH, on the\n"
        "clock of the device. The vehicle frame is at the device, with the axes of the car.\n"
        "Prints the errors of mount and latency, estimated from the first 20 s against the truth;\n"
        "they are near 0 if the options are correct.\n"
        "Examples:\n"
        "  rcs import comma2k19 gps_imu_comma2k19 -o comma.log\n"
        "  rcs import comma2k19 folder --gps-latency 0 --mount-rpy-deg 0,0,0 -o raw.log --json");
  }

  int run() override {
    if (!mount_rpy_deg_.empty()) {
      for (int i = 0; i < 3; ++i) {
        setup_.mount_rpy_rad[i] = radians(mount_rpy_deg_[static_cast<std::size_t>(i)]);
      }
    }
    setup_.receiver_stamps = stamps_ == "receiver";
    const Result<importers::CommaTables> tables = importers::load_comma2k19(folder_);
    if (!tables) return fail(kImportRecordingName, tables.error());
    recording::SensorLog log;
    const Result<importers::CommaCounts> counts =
        importers::import_comma2k19(*tables, setup_, &log);
    if (!counts) return fail(kImportRecordingName, counts.error());
    const Outcome written = write_whole(log, out_);
    if (!written) return fail(kImportRecordingName, written.error());

    Json json = {{"log", out_}};
    std::string text;
    add_counts(counts->sensors, &json, &text);
    json["SIM_TRUTH"] = to_json(counts->truth);
    text += to_text("SIM_TRUTH", counts->truth);
    add_check(importers::check_setup(log, Duration::zero(), std::chrono::seconds(20)), &json,
              &text);
    print_result(kImportRecordingName, json_, json, text);
    return kExitOk;
  }

 private:
  static constexpr std::string_view kImportRecordingName = "import comma2k19";

  /// To 0.01 deg; never -0.
  static double rounded_deg(double rad) { return std::round(100.0 * degrees(rad)) / 100.0 + 0.0; }

  static void add_check(const Result<importers::SetupCheck>& check, Json* json, std::string* text) {
    if (!check) {
      *text += fmt::format("mount and latency not checked: {}\n", check.error().message);
      return;
    }
    const importers::SetupCheck& c = *check;
    (*json)["first_20_s"] = {
        {"fixes", c.fixes},
        {"mount_pitch_deg", degrees(c.mount_pitch_rad)},
        {"mount_yaw_deg", degrees(c.mount_yaw_rad)},
        {"gps_latency_s", c.gps_latency_s},
        {"residual_along_m", c.residual_along_m},
        {"fix_minus_truth_m",
         {c.fix_minus_truth_m.x(), c.fix_minus_truth_m.y(), c.fix_minus_truth_m.z()}},
        {"rms_m", c.raw_rms_m}};
    *text += fmt::format(
        "first 20 s against the truth, {} fixes: horizontal RMS {:.2f} m; error of the options: "
        "latency {:.3f} s ({:.2f} m along-track residual), mount pitch {:.2f} deg, yaw {:.2f} "
        "deg; remaining bias of the fixes: {:.2f} m forward, {:.2f} m left, {:.2f} m up\n",
        c.fixes, c.raw_rms_m, c.gps_latency_s, c.residual_along_m, rounded_deg(c.mount_pitch_rad),
        rounded_deg(c.mount_yaw_rad), c.fix_minus_truth_m.x(), c.fix_minus_truth_m.y(),
        c.fix_minus_truth_m.z());
  }

  std::string folder_;
  std::string out_;
  importers::CommaSetup setup_;
  std::string stamps_ = "receiver";
  std::vector<double> mount_rpy_deg_;
  bool json_ = false;
};

class ImportImuGps final : public Command {
 public:
  explicit ImportImuGps(CLI::App* import)
      : Command(
            import->add_subcommand("imu-gps", "Import IMU, GPS and wheel data from CSV files")) {
    app()
        ->add_option("FILE", files_, "CSV: the first line names the columns")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--columns", map_, "TOML: meaning and unit of each column")
        ->required()
        ->transform(command_line::config_file());
    app()->add_option("-o,--out", out_, "output log")->type_name("FILE")->required();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The column file has a table for each sensor: [imu], [gps], [odometry]; see the examples\n"
        "config/import/*.toml, which explain every key. Units are mandatory. A row with a missing\n"
        "cell (empty, nan) is skipped and counted; rows with stamps that run backward are kept,\n"
        "counted and reported.\n"
        "Examples:\n"
        "  rcs import imu-gps 2014-03-26-000-Data.csv --columns config/import/balzer82.toml \\\n"
        "      -o dresden.log\n"
        "  rcs import imu-gps test1_imu.csv test1_fix.csv test1_odom.csv \\\n"
        "      --columns config/import/husky.toml -o husky.log");
  }

  int run() override {
    const Result<ParamFile> file = ParamFile::load(map_);
    if (!file) return fail(kImportRecordingName, file.error());
    const Result<importers::ImuGpsMap> map = importers::load_imu_gps_map(*file);
    if (!map) return fail(kImportRecordingName, map.error());
    std::vector<tools::CsvTable> tables;
    for (const std::string& path : files_) {
      Result<tools::CsvTable> table = tools::CsvTable::load(path);
      if (!table) return fail(kImportRecordingName, table.error());
      tables.push_back(std::move(table).value());
    }
    recording::SensorLog log;
    const Result<importers::ImportCounts> counts = importers::import_imu_gps(*map, tables, &log);
    if (!counts) return fail(kImportRecordingName, counts.error());
    const Outcome written = write_whole(log, out_);
    if (!written) return fail(kImportRecordingName, written.error());
    Json json = {{"log", out_}};
    std::string text;
    add_counts(*counts, &json, &text);
    print_result(kImportRecordingName, json_, json, text);
    return kExitOk;
  }

 private:
  static constexpr std::string_view kImportRecordingName = "import imu-gps";

  std::vector<std::string> files_;
  std::string map_;
  std::string out_;
  bool json_ = false;
};

}  // namespace

void add_recording_imports(CLI::App* import, Commands* commands) {
  commands->push_back(std::make_unique<ImportComma>(import));
  commands->push_back(std::make_unique<ImportImuGps>(import));
}

}  // namespace rcs::cli
