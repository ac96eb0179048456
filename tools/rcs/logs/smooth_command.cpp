// rcs smooth

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/smoothing/reference_output.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kSmoothName = "smooth";
constexpr double kRecordingShare = 0.25;  // of the total computing time

Result<smoothing::ReferenceVehicle> load_vehicle(const std::string& path) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  const Result<sp::SpConfig> sp = sp::load_sp_config(*file);
  if (!sp) return sp.error();
  const Result<wm::WmConfig> wm = wm::load_wm_config(*file);
  if (!wm) return wm.error();
  return smoothing::ReferenceVehicle{*sp, *wm};
}

class Smooth final : public Command {
 public:
  explicit Smooth(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "smooth", "Compute the reference trajectory of a recorded drive by smoothing")) {
    app()
        ->add_option("RUN", log_, "log with sensor channels")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->required()
        ->transform(command_line::config_file());
    app()
        ->add_option("-o,--out", out_, "TUM file of the poses; the other files are named after it")
        ->type_name("FILE")
        ->required();
    app()
        ->add_option("--rounds", params_.rounds,
                     "maximum number of rounds of registration and smoothing; ends earlier when\n"
                     "the poses change by less than 5 mm")
        ->capture_default_str()
        ->check(CLI::Range(1, 20));
    app()
        ->add_option("--jobs", params_.matching.jobs, "threads for the registration of scans")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    app()->add_flag("--json", json_, "print the consistency report as JSON on stdout");
    app()->footer(
        "Runs SP and WM on the log in lockstep. Then one pose graph combines INS, GPS, wheels and\n"
        "the registrations between scans, including revisits, which removes the drift.\n"
        "OUT            pose of the vehicle at the instant of each scan: t tx ty tz qx qy qz qw,\n"
        "               frame world (without GPS: local), as far as WM had initialized the motion\n"
        "OUT.kitti      the same poses, 12 numbers per line\n"
        "OUT.scans      poses that place the points of the scans correctly with the configured\n"
        "               mount and clock of the LADAR: for `rcs map build --poses`\n"
        "OUT.sigma.csv  one sigma of each pose, absolute and relative to the first, vehicle axes\n"
        "OUT.json       the consistency report\n"
        "SIM_TRUTH is used only to report the error of the poses.\n"
        "Example:\n"
        "  rcs smooth run.log --config config/demo3.toml -o out/reference.tum");
  }

  int run() override {
    const Outcome done = compute();
    return done ? kExitOk : fail(kSmoothName, done.error());
  }

 private:
  Outcome compute() {
    const Result<smoothing::ReferenceVehicle> vehicle = load_vehicle(config_);
    if (!vehicle) return vehicle.error();
    // Five files, all or none.
    std::array<std::unique_ptr<tools::OutputFile>, 5> files;
    const std::array<const char*, 5> kEndings = {"", ".kitti", ".scans", ".sigma.csv", ".json"};
    for (std::size_t k = 0; k < files.size(); ++k) {
      files[k] = std::make_unique<tools::OutputFile>(out_ + kEndings[k]);
    }
    if (files[0]->in_place()) {
      return Error{out_ + ": is a device; OUT must be a file name, five files are named after it"};
    }
    std::array<std::string, 5> texts;
    if (Outcome done = make(*vehicle, &texts); !done) return done;
    for (std::size_t k = 0; k < files.size(); ++k) {
      if (Outcome done = files[k]->write(texts[k]); !done) return done;
    }
    for (const std::unique_ptr<tools::OutputFile>& file : files) {
      if (Outcome done = file->commit(); !done) return done;
    }
    fmt::print("{}", json_ ? texts[4] : summary_);
    return Done{};
  }

  Outcome make(const smoothing::ReferenceVehicle& vehicle, std::array<std::string, 5>* texts) {
    const InterruptGuard interrupt;
    const auto stop = [&interrupt] { return interrupt.requested(); };
    constexpr std::int64_t kWhole = 1000;
    Progress progress(kSmoothName, kWhole);
    const Result<smoothing::ReferenceRecording> recording = smoothing::record_run(
        log_, vehicle,
        [&](std::int64_t done, std::int64_t all) {
          progress.at(
              static_cast<std::int64_t>(kRecordingShare * kWhole * static_cast<double>(done) /
                                        static_cast<double>(std::max<std::int64_t>(all, 1))));
        },
        stop);
    if (!recording) return recording.error();
    if (!recording->damage.empty()) {
      fmt::print(stderr, "rcs smooth: {}: {}\n", log_, recording->damage);
    }
    if (recording->refused > 0) {
      fmt::print(stderr,
                 "rcs smooth: {}: {} messages skipped: damaged, not finite or with a stamp that "
                 "runs backward\n",
                 log_, recording->refused);
    }
    if (recording->inertial.empty()) {
      fmt::print(stderr, "rcs smooth: {}: no INS: using the motion of SP instead\n", log_);
    }
    const Result<smoothing::ReferenceResult> result = smoothing::smooth(
        *recording, vehicle, params_,
        [&](double share) {
          const double all = kRecordingShare + (1.0 - kRecordingShare) * share;
          progress.at(static_cast<std::int64_t>(kWhole * all));
        },
        stop);
    if (!result) return Error{log_ + ": " + result.error().message};
    if (!result->solved.converged) {
      fmt::print(stderr, "rcs smooth: {}: the last smoothing did not converge\n", log_);
    }
    const std::vector<smoothing::ReferencePose> poses =
        smoothing::reference_poses(*recording, *result);
    if (poses.size() < recording->scans.size()) {
      fmt::print(stderr,
                 "rcs smooth: {}: {} scans outside the time in which WM published the motion "
                 "have no pose\n",
                 log_, recording->scans.size() - poses.size());
    }
    const smoothing::ReferenceReport report =
        smoothing::report_reference(*recording, *result, poses);
    tools::Trajectory vehicle_poses;
    tools::Trajectory seen;
    for (const smoothing::ReferencePose& p : poses) {
      vehicle_poses.push_back({p.stamp, p.T});
      seen.push_back({p.stamp, p.T_seen});
    }
    *texts = {tools::format_tum(vehicle_poses), tools::format_kitti(vehicle_poses),
              tools::format_tum(seen), smoothing::format_sigmas(poses),
              report::json_document(kSmoothName, to_json(report, *result))};
    summary_ = to_text(report, *result);
    return Done{};
  }

  std::string log_;
  std::string config_;
  std::string out_;
  std::string summary_;
  smoothing::ReferenceParams params_;
  bool json_ = false;
};

}  // namespace

void add_smooth_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Smooth>(rcs));
}

}  // namespace rcs::cli
