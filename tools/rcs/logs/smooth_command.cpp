// rcs truth

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/smoothing/reference_output.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kName = "truth";
constexpr double kRecordingShare = 0.25;  // of the time that all takes

Result<smoothing::TruthVehicle> load_vehicle(const std::string& path) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  const Result<sp::SpConfig> sp = sp::load_sp_config(*file);
  if (!sp) return sp.error();
  const Result<wm::WmConfig> wm = wm::load_wm_config(*file);
  if (!wm) return wm.error();
  return smoothing::TruthVehicle{*sp, *wm};
}

class Truth final : public Command {
 public:
  explicit Truth(CLI::App* rcs)
      : Command(
            rcs->add_subcommand("truth", "Where a recorded drive really went, computed offline")) {
    app()
        ->add_option("RUN", log_, "log with sensor channels")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("-o,--out", out_, "TUM file of the poses; others are named after it")
        ->required();
    app()
        ->add_option("--rounds", params_.rounds,
                     "of registering the scans and smoothing, at most; it ends when poses "
                     "stay\nwhere they are to 5 mm")
        ->capture_default_str()
        ->check(CLI::Range(1, 20));
    app()
        ->add_option("--jobs", params_.matching.jobs, "threads that register scans")
        ->capture_default_str()
        ->check(CLI::Range(1, 256));
    app()->add_flag("--json", json_, "the consistency report as JSON on stdout");
    app()->footer(
        "The log goes through SP and WM in lockstep; then INS, GPS, wheels and the scans among\n"
        "themselves, revisits too, are smoothed together, by which the drift of none is left.\n"
        "OUT            the vehicle at every scan's instant: t tx ty tz qx qy qz qw, frame world\n"
        "               (without GPS: local), where WM knew the motion\n"
        "OUT.kitti      the same, 12 numbers a line\n"
        "OUT.scans      where the scans' points lie, as the configuration has the LADAR's mount "
        "and\n"
        "               clock: for `rcs map build --poses`\n"
        "OUT.sigma.csv  one sigma of each pose, absolute and since the first, vehicle axes\n"
        "OUT.json       the consistency report\n"
        "SIM_TRUTH is never used but to say how far off the poses are.\n"
        "Example:\n"
        "  rcs truth run.log --config config/demo3.toml -o out/truth.tum");
  }

  int run() override {
    const Outcome done = compute();
    return done ? kExitOk : fail(kName, done.error());
  }

 private:
  Outcome compute() {
    const Result<smoothing::TruthVehicle> vehicle = load_vehicle(config_);
    if (!vehicle) return vehicle.error();
    // Five files, all or none.
    std::array<std::unique_ptr<tools::OutputFile>, 5> files;
    const std::array<const char*, 5> kEndings = {"", ".kitti", ".scans", ".sigma.csv", ".json"};
    for (std::size_t k = 0; k < files.size(); ++k) {
      files[k] = std::make_unique<tools::OutputFile>(out_ + kEndings[k]);
    }
    if (files[0]->in_place()) return Error{out_ + ": a device: five files are named after OUT"};
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

  Outcome make(const smoothing::TruthVehicle& vehicle, std::array<std::string, 5>* texts) {
    const InterruptGuard interrupt;
    const auto stop = [&interrupt] { return interrupt.requested(); };
    constexpr std::int64_t kWhole = 1000;
    Progress progress(kName, kWhole);
    const Result<smoothing::TruthRecording> recording = smoothing::record_run(
        log_, vehicle,
        [&](std::int64_t done, std::int64_t all) {
          progress.at(
              static_cast<std::int64_t>(kRecordingShare * kWhole * static_cast<double>(done) /
                                        static_cast<double>(std::max<std::int64_t>(all, 1))));
        },
        stop);
    if (!recording) return recording.error();
    if (!recording->damage.empty()) {
      fmt::print(stderr, "rcs truth: {}: {}\n", log_, recording->damage);
    }
    if (recording->refused > 0) {
      fmt::print(stderr,
                 "rcs truth: {}: {} messages that are damaged, no numbers or run backward "
                 "left out\n",
                 log_, recording->refused);
    }
    if (recording->inertial.empty()) {
      fmt::print(stderr, "rcs truth: {}: no INS: SP's motion takes its place\n", log_);
    }
    const Result<smoothing::TruthResult> result = smoothing::smooth(
        *recording, vehicle, params_,
        [&](double share) {
          const double all = kRecordingShare + (1.0 - kRecordingShare) * share;
          progress.at(static_cast<std::int64_t>(kWhole * all));
        },
        stop);
    if (!result) return Error{log_ + ": " + result.error().message};
    if (!result->solved.converged) {
      fmt::print(stderr, "rcs truth: {}: the last smoothing has not converged\n", log_);
    }
    const std::vector<smoothing::TruthPose> poses = smoothing::truth_poses(*recording, *result);
    if (poses.size() < recording->scans.size()) {
      fmt::print(stderr,
                 "rcs truth: {}: {} scans from before WM knew the motion, or after, have no "
                 "pose\n",
                 log_, recording->scans.size() - poses.size());
    }
    const smoothing::TruthReport report = smoothing::report_truth(*recording, *result, poses);
    tools::Trajectory vehicle_poses;
    tools::Trajectory seen;
    for (const smoothing::TruthPose& p : poses) {
      vehicle_poses.push_back({p.stamp, p.T});
      seen.push_back({p.stamp, p.T_seen});
    }
    *texts = {tools::format_tum(vehicle_poses), tools::format_kitti(vehicle_poses),
              tools::format_tum(seen), smoothing::format_sigmas(poses),
              to_json(report, *result).dump(2) + "\n"};
    summary_ = to_text(report, *result);
    return Done{};
  }

  std::string log_;
  std::string config_;
  std::string out_;
  std::string summary_;
  smoothing::TruthParams params_;
  bool json_ = false;
};

}  // namespace

void add_truth_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Truth>(rcs));
}

}  // namespace rcs::cli
