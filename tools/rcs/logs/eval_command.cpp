// rcs eval

#include <fmt/format.h>

#include <algorithm>

#include "tools/base/files.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/evaluation/metrics.h"
#include "tools/evaluation/run_trace.h"
#include "tools/rcs/command.h"
#include "tools/rcs/logs/driving_section.h"
#include "tools/rcs/logs/run_reading.h"
#include "tools/rcs/page_origin.h"
#include "tools/report/html_page.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kEvalName = "eval";
/// Truth at 10 Hz is still interpolated across one missing sample.
constexpr Duration kMaxTruthGap = std::chrono::milliseconds(250);

Result<evaluation::PosePairs> pair_by_stamp(const recording::ScanPoses& scans,
                                            const tools::Trajectory& truth) {
  evaluation::PosePairs pairs;
  for (const tools::StampedPose& s : scans.poses) {
    const std::optional<Pose> T = tools::pose_at(truth, s.stamp, kMaxTruthGap);
    if (!T) continue;
    pairs.stamps.push_back(s.stamp);
    pairs.estimate.push_back(s.T);
    pairs.truth.push_back(*T);
  }
  if (pairs.size() == 0) {
    return Error{"no scan has a true pose at its time; scans and truth may use different clocks"};
  }
  return pairs;
}

/// Row first + i of the truth belongs to the scan whose number is i after that of the first scan.
Result<evaluation::PosePairs> pair_by_row(const recording::ScanPoses& scans,
                                          const std::vector<Pose>& truth,
                                          std::optional<std::size_t> first,
                                          const std::string& file) {
  const std::int64_t first_id = scans.scan_ids.front();
  if (!std::is_sorted(scans.scan_ids.begin(), scans.scan_ids.end())) {
    return Error{"the numbers of the scans are not in ascending order"};
  }
  const std::size_t rows = static_cast<std::size_t>(scans.scan_ids.back()) -
                           static_cast<std::size_t>(first_id) + 1;  // 0: more than fit
  if (!first && truth.size() != rows) {
    return Error{
        fmt::format("{}: {} rows for {} scans; name the row of the first scan by --first N", file,
                    truth.size(), rows)};
  }
  const std::size_t offset = first.value_or(0);
  if (rows == 0 || rows > truth.size() || offset > truth.size() - rows) {
    return Error{fmt::format("{}: {} rows, but the {} scans from row {} (counted from 0) need more",
                             file, truth.size(), rows, offset)};
  }
  evaluation::PosePairs pairs;
  for (std::size_t i = 0; i < scans.poses.size(); ++i) {
    pairs.stamps.push_back(scans.poses[i].stamp);
    pairs.estimate.push_back(scans.poses[i].T);
    pairs.truth.push_back(truth[offset + static_cast<std::size_t>(scans.scan_ids[i] - first_id)]);
  }
  return pairs;
}

class Eval final : public Command {
 public:
  explicit Eval(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "eval", "Evaluate a run: errors, export of the trajectory, HTML page")) {
    app()
        ->add_option("RUN", run_, "log of a replay, or of a live run")
        ->required()
        ->check(CLI::ExistingFile);
    CLI::Option* truth =
        app()->add_option("--truth", truth_file_, "file with the true poses of the vehicle");
    truth->check(CLI::ExistingFile);
    app()
        ->add_option("--format", format_,
                     "format of the truth: kitti (one row per scan) or tum (by stamps)")
        ->check(CLI::IsMember({"kitti", "tum"}))
        ->needs(truth);
    app()
        ->add_option("--first", first_, "row of a KITTI truth that belongs to the first scan")
        ->needs(truth);
    app()
        ->add_option("--truth-log", truth_log_,
                     "log with SIM_TRUTH; default: the run itself if it has SIM_TRUTH")
        ->check(CLI::ExistingFile)
        ->excludes(truth);
    app()
        ->add_option(
            "--frame", frame_,
            "frame of the poses that are evaluated or exported: world (absolute, may\n"
            "step), local (smooth frame of WM as published; follows the corrections of SP\n"
            "with a delay), rolling (the registrations of SP)")
        ->capture_default_str()
        ->check(CLI::IsMember({"world", "local", "rolling"}));
    CLI::Option* exported =
        app()
            ->add_option("--export", export_,
                         "write the pose of the vehicle at the instant of each scan; the name of\n"
                         "the file ends in .tum or .kitti, which is the format")
            ->type_name("FILE");
    app()
        ->add_option("--from", from_s_,
                     "begin of the evaluation, time after the earliest truth, belief or scan [s]")
        ->check(CLI::Range(0.0, 1e9));
    app()
        ->add_option(
            "--to", to_s_,
            "end of the evaluation, exclusive, time after the earliest truth, belief or scan [s]")
        ->check(CLI::Range(0.0, 1e9));
    app()->add_option("--report", report_, "write a self-contained HTML page")->type_name("FILE");
    app()
        ->add_option("--svg", svg_, "write a plot of the course as an SVG file")
        ->type_name("FILE");
    app()->add_flag("--json", json_, "print the results as JSON")->excludes(exported);
    app()->footer(
        "The pose of a scan is that of the vehicle at the reference instant of the scan, from the\n"
        "belief of WM (interpolated along the screw motion) or, without WM, from the rolling map\n"
        "of SP. A run without a LADAR is evaluated at the stamps of WM.\n"
        "ATE is computed after alignment over SE(3); RPE over KITTI's 100-800 m as far as they\n"
        "fit, else over 5-50 m. With SIM_TRUTH the error of the world pose is also compared with\n"
        "its predicted sigmas.\n"
        "Examples:\n"
        "  rcs eval run.log --truth poses.txt --format kitti --json\n"
        "  rcs eval run.log --export run.tum --frame world\n"
        "  rcs eval simulated.log --report out/report.html\n"
        "  rcs eval comma_result.log --from 20 --json");
  }

  int run() override {
    const std::string format = export_.substr(std::min(export_.rfind('.'), export_.size()));
    if (!export_.empty() && format != ".tum" && format != ".kitti") {
      fmt::print(stderr, "rcs eval: --export {}: the name must end in .tum or .kitti\n", export_);
      return kExitUsage;
    }
    if (!truth_file_.empty() && format_.empty()) {
      fmt::print(stderr, "rcs eval: --truth needs --format kitti or tum\n");
      return kExitUsage;
    }
    Result<recording::RunLog> log = read_run(kEvalName, run_);
    if (!log) return fail(kEvalName, log.error());
    if (!log->damage.empty()) fmt::print(stderr, "rcs eval: {}: {}\n", run_, log->damage);
    if (const Outcome truth = take_truth_log(&log.value()); !truth) {
      return fail(kEvalName, truth.error());
    }
    recording::cut(from_seconds(from_s_), from_seconds(to_s_), &log.value());

    recording::Frame frame = frame_ == "world" ? recording::Frame::kWorld
                                               : (frame_ == "local" ? recording::Frame::kLocal
                                                                    : recording::Frame::kRolling);
    if (frame == recording::Frame::kLocal && log->nav.empty()) {
      fmt::print(stderr, "rcs eval: no WM_NAV_STATE in {}: using the rolling poses of SP\n", run_);
      frame = recording::Frame::kRolling;
    }
    const Result<recording::ScanPoses> scans = recording::poses_at_scans(*log, frame);
    if (!scans) return fail(kEvalName, scans.error());
    if (scans->carried > 0) {
      fmt::print(stderr,
                 "rcs eval: {} scans without a belief of WM: poses extrapolated by the rolling "
                 "map of SP\n",
                 scans->carried);
    }
    if (!export_.empty()) return export_poses(scans->poses, format == ".tum");

    std::optional<evaluation::PosePairs> pairs;
    if (!truth_file_.empty() || !log->truth.empty()) {
      Result<evaluation::PosePairs> paired = pair(*log, *scans);
      if (!paired) return fail(kEvalName, paired.error());
      pairs = std::move(paired).value();
    }
    return evaluate(*log, *scans, frame, pairs);
  }

 private:
  Outcome take_truth_log(recording::RunLog* log) const {
    if (truth_log_.empty()) return Done{};
    Result<recording::RunLog> other = read_run(kEvalName, truth_log_);
    if (!other) return other.error();
    if (other->truth.empty()) return Error{truth_log_ + ": no SIM_TRUTH"};
    log->truth = std::move(other->truth);
    log->truth_datum = other->truth_datum;
    return Done{};
  }

  [[nodiscard]] int export_poses(const tools::Trajectory& poses, bool as_tum) const {
    const std::string text = as_tum ? tools::format_tum(poses) : tools::format_kitti(poses);
    const Outcome written = tools::write_text(export_, text);
    if (!written) return fail(kEvalName, written.error());
    fmt::print(stderr, "{}: {} poses\n", export_, poses.size());
    return kExitOk;
  }

  [[nodiscard]] Result<evaluation::PosePairs> pair(const recording::RunLog& log,
                                                   const recording::ScanPoses& scans) const {
    if (truth_file_.empty()) return pair_by_stamp(scans, log.truth);
    const Result<std::string> text = tools::read_text(truth_file_);
    if (!text) return text.error();
    if (format_ == "tum") {
      const Result<tools::Trajectory> truth = tools::parse_tum(*text, truth_file_);
      return truth ? pair_by_stamp(scans, *truth) : Result<evaluation::PosePairs>(truth.error());
    }
    const Result<std::vector<Pose>> truth = tools::parse_kitti(*text, truth_file_);
    return truth ? pair_by_row(scans, *truth, first_, truth_file_)
                 : Result<evaluation::PosePairs>(truth.error());
  }

  int evaluate(const recording::RunLog& log, const recording::ScanPoses& scans,
               recording::Frame frame, const std::optional<evaluation::PosePairs>& pairs) const {
    const evaluation::RunMetrics run = evaluation::run_metrics(log);
    const std::optional<evaluation::WorldMetrics> world =
        evaluation::world_metrics(log, log.truth, log.truth_datum);
    const Stamp zero = scans.poses.front().stamp;
    const std::vector<evaluation::TimeInterval> outages = evaluation::gps_outages(log);
    std::vector<evaluation::OutageMetrics> outage;
    if (world) {
      for (const evaluation::TimeInterval& i : outages) {
        outage.push_back(evaluation::outage_metrics(*world, i));
      }
    }

    evaluation::Json json = {
        {"run", run_}, {"frame", evaluation::frame_name(frame)}, {"metrics", to_json(run)}};
    std::vector<report::Table> tables;
    if (pairs) {
      const evaluation::TrajectoryMetrics f = evaluation::trajectory_metrics(*pairs);
      json["trajectory"] = to_json(f);
      tables.push_back(evaluation::absolute_table(f));
      tables.back().header.front() += fmt::format(", frame {}", evaluation::frame_name(frame));
      tables.push_back(evaluation::relative_table(f));
    }
    if (world) {
      json["world"] = to_json(*world);
      tables.push_back(evaluation::world_table(*world));
      if (!outage.empty()) tables.push_back(outage_table(outage, zero));
      for (const evaluation::OutageMetrics& o : outage) json["outages"].push_back(to_json(o, zero));
    }
    tables.push_back(evaluation::scan_table(run));
    if (!run.nodes.empty()) tables.push_back(evaluation::latency_table(run));

    if (json_) {
      fmt::print("{}", report::json_document(kEvalName, json));
    } else {
      for (const report::Table& t : tables) fmt::print("{}\n", to_text(t));
      if (world) {
        fmt::print("NEES of the world pose, per degree of freedom: {:.2f}\n", world->nees_per_dof);
      }
    }
    return write_pictures(log, scans, frame, run, pairs, world, outages, tables);
  }

  int write_pictures(const recording::RunLog& log, const recording::ScanPoses& scans,
                     recording::Frame frame, const evaluation::RunMetrics& run,
                     const std::optional<evaluation::PosePairs>& pairs,
                     const std::optional<evaluation::WorldMetrics>& world,
                     const std::vector<evaluation::TimeInterval>& outages,
                     const std::vector<report::Table>& tables) const {
    if (report_.empty() && svg_.empty()) return kExitOk;
    const Stamp zero = scans.poses.front().stamp;
    const Pose T_truth_frame =
        pairs ? evaluation::align(*pairs, evaluation::Alignment::kRigid) : Pose{};
    tools::Trajectory truth;
    tools::Trajectory estimate = scans.poses;
    if (world) {
      truth = log.truth;
      estimate.clear();
      for (const evaluation::WorldError& e : world->errors) {
        estimate.push_back({e.stamp, e.T_truthworld_vehicle});
      }
    } else if (pairs) {
      for (std::size_t i = 0; i < pairs->size(); ++i) {
        truth.push_back({pairs->stamps[i], pairs->truth[i]});
      }
      for (tools::StampedPose& s : estimate) s.T = T_truth_frame * s.T;
    }
    const report::Plot course =
        evaluation::course_plot(truth, {{"estimate", estimate}}, outages,
                                world ? recording::Frame::kWorld : recording::Frame::kLocal);
    if (!svg_.empty()) {
      const Outcome written = tools::write_text(svg_, report::render(course, true));
      if (!written) return fail(kEvalName, written.error());
    }
    if (report_.empty()) return kExitOk;

    const Result<evaluation::RunTrace> trace = evaluation::read_trace(run_);
    const bool named = trace && !trace->configuration.empty();
    report::HtmlPage page("Run " + run_,
                          page_origin(named ? trace->configuration : "not recorded in the log"));
    page.without_verdict("No limit was set; rcs report --min-factor and rcs drill judge.");
    if (!pairs) {
      page.paragraph(
          "Errors are left out: the log has no ground truth (SIM_TRUTH); --truth and --truth-log "
          "name one.");
    }
    for (const report::Table& t : tables) page.table(t);
    page.heading("Course");
    page.plot(course);
    add_driving(run_, &page);
    if (world) {
      page.heading("Error and predicted sigma of WM");
      page.paragraph(
          fmt::format("NEES of the world pose, per degree of freedom: {:.2f}. It is the squared "
                      "error normalized by the published covariance: 1 for a consistent "
                      "covariance, more for an overconfident one.",
                      world->nees_per_dof));
      for (const report::Plot& p : evaluation::error_plots(*world, outages, zero)) page.plot(p);
    } else if (pairs) {
      page.plot(evaluation::aligned_error_plot(*pairs, T_truth_frame));
    }
    Result<report::CellMap> map = evaluation::read_map(run_, scans.poses);
    if (map) {
      page.heading("Map");
      page.plot(evaluation::map_plot(std::move(map).value(), scans.poses, frame));
    }
    page.heading("Latencies");
    if (run.chain_ms) {
      page.plot(evaluation::latency_plot("From the last facet of a scan to nav_state",
                                         run.chain_samples_ms));
    }
    for (const report::Plot& p : evaluation::node_plots(log)) page.plot(p);
    const Outcome written = tools::write_text(report_, page.finish());
    return written ? kExitOk : fail(kEvalName, written.error());
  }

  std::string run_;
  std::string truth_file_;
  std::string format_;
  std::optional<std::size_t> first_;
  std::string truth_log_;
  std::string frame_ = "local";
  std::string export_;
  double from_s_ = 0.0;
  double to_s_ = 1e9;
  std::string report_;
  std::string svg_;
  bool json_ = false;
};

}  // namespace

void add_eval_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Eval>(rcs));
}

}  // namespace rcs::cli
