// rcs report

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "rcs/base/text.h"
#include "tools/base/files.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/evaluation/metrics.h"
#include "tools/evaluation/run_comparison.h"
#include "tools/evaluation/run_trace.h"
#include "tools/evaluation/uncertainty.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/logs/driving_section.h"
#include "tools/rcs/logs/run_reading.h"
#include "tools/rcs/page_origin.h"
#include "tools/report/html_page.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kReportName = "report";
constexpr std::size_t kMaxDrawn = 4;

/// A run and its metrics.
struct ReportedRun {
  recording::RunLog log;
  evaluation::RunTrace trace;
  evaluation::RunMetrics metrics;
  std::optional<evaluation::WorldMetrics> world;  ///< nullopt for all runs: without a truth
};

class ReportCommand final : public Command {
 public:
  explicit ReportCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand("report", "Show a drive, and compare runs of it")) {
    app()->add_option("RUN", runs_, "[NAME=]LOG; the first run is shown in full")->required();
    app()
        ->add_option("--truth-log", truth_log_,
                     "log with SIM_TRUTH; default: the first of the runs that has it")
        ->check(CLI::ExistingFile);
    add_numbers(app(), "--gps-cut", &gps_cut_s_, "FROM,TO", 0.0, 1e7,
                "GPS outage, times after the first truth, without one after the first pose [s];\n"
                "default: intervals longer than 2.5 s in which no run accepted a fix");
    app()
        ->add_option("-o,--out", out_, "output file, a self-contained HTML page")
        ->type_name("FILE")
        ->required();
    app()
        ->add_option("--svg", svg_, "write a plot of course and errors as an SVG file")
        ->type_name("FILE");
    app()
        ->add_option(
            "--min-factor", min_factor_,
            "exit status 1 unless, over an outage, the rms error without the LADAR is at\n"
            "least this many times the rms error with the LADAR, other sensors being equal")
        ->check(CLI::PositiveNumber);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Errors are horizontal, over the whole outage. The sources that a run fused are read from\n"
        "its WM_INNOVATION. With more than four runs the plots show the first and the last two.\n"
        "Without SIM_TRUTH the errors are left out: the page has the course, the planned paths,\n"
        "speed, uncertainty and protection levels, outages, map, latencies and registrations.\n"
        "Examples:\n"
        "  rcs report run.log -o report.html\n"
        "  rcs replay config/demo3.toml run.log -o without.log --without LADAR_RANGES\n"
        "  rcs report \"all sensors=run.log\" \"without LADAR=without.log\" -o report.html");
  }

  int run() override {
    if (!gps_cut_s_.empty() && gps_cut_s_[1] <= gps_cut_s_[0]) {
      return wrong_usage(kReportName, Error{"--gps-cut FROM,TO: TO must be after FROM"});
    }
    if (const Outcome read = read_runs(); !read) return fail(kReportName, read.error());
    if (min_factor_ > 0.0 && !note_.empty()) {
      return fail(kReportName, Error{"--min-factor needs the errors. " + note_});
    }
    if (const Outcome written = write_page(); !written) return fail(kReportName, written.error());
    const std::optional<double> factor = evaluation::ladar_factor(compared_);
    if (min_factor_ > 0.0 && !factor) {
      return fail(kReportName,
                  Error{"--min-factor: no two runs differ by the LADAR alone during a GPS "
                        "outage"});
    }
    print_metrics();
    return judge(factor.value_or(0.0));
  }

 private:
  Outcome read_runs() {
    if (!truth_log_.empty()) {
      const Result<recording::RunLog> truth = read_run(kReportName, truth_log_);
      if (!truth) return truth.error();
      if (truth->truth.empty()) return Error{truth_log_ + ": no SIM_TRUTH"};
      use_truth_of(*truth);
    }
    for (const std::string& run : runs_) {
      const std::size_t equals = run.find('=');
      const std::string path = equals == std::string::npos ? run : run.substr(equals + 1);
      Result<recording::RunLog> log = read_run(kReportName, path);
      if (!log) return log.error();
      if (!log->damage.empty()) fmt::print(stderr, "rcs report: {}: {}\n", path, log->damage);
      Result<evaluation::RunTrace> trace = evaluation::read_trace(path);
      if (!trace) return trace.error();
      if (truth_.empty()) use_truth_of(*log);
      names_.push_back(equals == std::string::npos ? path : run.substr(0, equals));
      evaluation::RunMetrics metrics = evaluation::run_metrics(*log);
      reported_.push_back(
          {std::move(log).value(), std::move(trace).value(), std::move(metrics), std::nullopt});
    }
    if (Outcome done = place_scans(); !done) return done;
    if (Outcome done = compute_errors(); !done) return done;
    find_outages();
    for (std::size_t k = 0; k < reported_.size(); ++k) {
      const ReportedRun& run = reported_[k];
      compared_.push_back(evaluation::compare_run(names_[k], run.log, run.trace,
                                                  run.world ? &*run.world : nullptr, outages_));
    }
    return Done{};
  }

  /// In frame world if the first run has poses in it, else local or rolling.
  Outcome place_scans() {
    Error error;
    for (const recording::Frame frame :
         {recording::Frame::kWorld, recording::Frame::kLocal, recording::Frame::kRolling}) {
      Result<recording::ScanPoses> scans = recording::poses_at_scans(reported_.front().log, frame);
      if (!scans) {
        error = scans.error();
        continue;
      }
      frame_ = frame;
      scans_ = std::move(scans).value();
      return Done{};
    }
    return error;
  }

  void use_truth_of(const recording::RunLog& log) {
    if (log.truth.empty()) return;
    truth_ = log.truth;
    truth_datum_ = log.truth_datum;
    truth_path_ = log.path;
  }

  /// Errors of all runs, or of none and the reason in `note_`.
  Outcome compute_errors() {
    std::string reason;
    if (truth_.empty()) {
      reason = reported_.size() == 1 ? "the log has no ground truth (SIM_TRUTH)"
                                     : "no log has a ground truth (SIM_TRUTH)";
      reason += "; --truth-log names a log with it";
    }
    for (ReportedRun& run : reported_) {
      if (!reason.empty()) break;
      run.world = evaluation::world_metrics(run.log, truth_, truth_datum_);
      if (run.world) continue;
      reason = run.log.path + " has no world pose of WM within the time of the truth";
      if (!truth_log_.empty()) return Error{reason};
    }
    if (reason.empty()) return Done{};
    note_ = "Errors and the comparison by errors are left out: " + reason + ".";
    truth_.clear();
    for (ReportedRun& run : reported_) run.world.reset();
    return Done{};
  }

  /// Without --gps-cut: intervals in which all runs were without GPS. Runs with large errors accept
  /// GPS again later than others; the interval ends with the first run that accepts it.
  void find_outages() {
    if (gps_cut_s_.empty()) {
      outages_ = evaluation::gps_outages(reported_.front().log);
      for (const ReportedRun& run : reported_) {
        outages_ = evaluation::common_intervals(outages_, evaluation::gps_outages(run.log));
      }
      return;
    }
    outages_ = {{zero() + from_seconds(gps_cut_s_[0]), zero() + from_seconds(gps_cut_s_[1])}};
  }

  /// Checks --min-factor.
  [[nodiscard]] int judge(double factor) const {
    if (min_factor_ <= 0.0 || factor >= min_factor_) return kExitOk;
    return negative(kReportName,
                    Error{fmt::format("without the LADAR the rms error is at most {:.2f} times "
                                      "that with it; at least {:g} times was required "
                                      "(--min-factor)",
                                      factor, min_factor_)});
  }

  [[nodiscard]] Stamp zero() const {
    return truth_.empty() ? scans_.poses.front().stamp : truth_.front().stamp;
  }

  [[nodiscard]] std::string outage_text() const {
    std::string text;
    for (const evaluation::OutageMetrics& o : compared_.front().outages) {
      text += fmt::format("{}{} from {:.0f} s to {:.0f} s, over {:.0f} m.", text.empty() ? "" : " ",
                          evaluation::gps_denied(compared_) ? "GPS denied" : "Interval",
                          seconds(o.interval.from - zero()), seconds(o.interval.to - zero()),
                          o.driven_m);
    }
    return text.empty() ? "GPS was not denied for longer than 2.5 s." : text;
  }

  void print_metrics() const {
    if (json_) {
      evaluation::Json json = {{"runs", evaluation::Json::array()}};
      for (std::size_t k = 0; k < compared_.size(); ++k) {
        evaluation::Json run = to_json(compared_[k], zero());
        run["log"] = reported_[k].log.path;
        run["world"] = nullptr;
        if (reported_[k].world) run["world"] = to_json(*reported_[k].world);
        run["metrics"] = to_json(reported_[k].metrics);
        json["runs"].push_back(std::move(run));
      }
      if (const std::optional<double> factor = evaluation::ladar_factor(compared_)) {
        json["ladar_factor"] = *factor;
      }
      if (!note_.empty()) json["note"] = note_;
      fmt::print("{}", report::json_document(kReportName, json));
      return;
    }
    if (!note_.empty()) fmt::print("{}\n", wrapped(note_, 0));
    fmt::print("{}\n{}\n{}\n\n{}\n{}", outage_text(),
               to_text(evaluation::comparison_table(compared_)),
               wrapped(evaluation::comparison_text(compared_), 0),
               to_text(evaluation::latency_table(reported_.front().metrics)),
               to_text(evaluation::scan_table(reported_.front().metrics)));
  }

  /// The runs in the common plots: at most the number of colours.
  [[nodiscard]] std::vector<std::size_t> drawn() const {
    const std::size_t n = reported_.size();
    if (n > kMaxDrawn) return {0, n - 2, n - 1};
    std::vector<std::size_t> all(n);
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
  }

  [[nodiscard]] report::Plot course() const {
    std::vector<evaluation::NamedTrajectory> estimates;
    const std::optional<Geodetic>& datum = reported_.front().log.world_datum;
    for (const std::size_t k : drawn()) {
      const ReportedRun& run = reported_[k];
      evaluation::NamedTrajectory estimate{names_[k], {}};
      if (run.world) {
        for (const evaluation::WorldError& e : run.world->errors) {
          estimate.poses.push_back({e.stamp, e.T_truthworld_vehicle});
        }
      } else if (k == 0) {
        estimate.poses = scans_.poses;
      } else if (Result<recording::ScanPoses> scans = recording::poses_at_scans(run.log, frame_)) {
        estimate.poses = std::move(scans->poses);
        if (frame_ == recording::Frame::kWorld && datum && run.log.world_datum) {
          evaluation::move_between_worlds(*datum, *run.log.world_datum, &estimate.poses);
        }
      }
      estimates.push_back(std::move(estimate));
    }
    const bool world = reported_.front().world.has_value();
    return evaluation::course_plot(truth_, estimates, outages_,
                                   world ? recording::Frame::kWorld : frame_);
  }

  [[nodiscard]] report::Plot errors() const {
    std::vector<std::pair<std::string, const evaluation::WorldMetrics*>> runs;
    for (const std::size_t k : drawn()) {
      runs.emplace_back(names_[k], &*reported_[k].world);
    }
    return evaluation::comparison_plot(runs, outages_, zero());
  }

  [[nodiscard]] std::vector<report::Plot> bounds() const {
    const ReportedRun& main = reported_.front();
    return evaluation::uncertainty_plots(main.log, main.trace, main.world ? &*main.world : nullptr,
                                         outages_, zero());
  }

  void add_verdict(report::HtmlPage* page) const {
    if (min_factor_ <= 0.0) return page->without_verdict("No limit was set; --min-factor judges.");
    const std::optional<double> factor = evaluation::ladar_factor(compared_);
    page->verdict(factor && *factor >= min_factor_,
                  factor ? fmt::format("without the LADAR the rms error is {:.2f} times that with "
                                       "it; at least {:g} times is required.",
                                       *factor, min_factor_)
                         : "no two runs differ by the LADAR alone.");
  }

  /// Begin and end of each outage, and the largest error, in the log of the first run.
  [[nodiscard]] std::vector<report::Moment> moments() const {
    const ReportedRun& main = reported_.front();
    const std::optional<Stamp> begin = recording::begin_in_sensor_time(main.log.path);
    if (!begin) return {};
    const auto in_log_s = [&](Stamp stamp) { return std::max(0.0, seconds(stamp - *begin)); };
    std::vector<report::Moment> all;
    for (const evaluation::TimeInterval& o : outages_) {
      if (all.size() >= 6) break;
      all.push_back({"begin of the outage", in_log_s(o.from)});
      all.push_back({"its end", in_log_s(o.to)});
    }
    if (!main.world) return all;
    const auto largest =
        std::max_element(main.world->errors.begin(), main.world->errors.end(),
                         [](const evaluation::WorldError& a, const evaluation::WorldError& b) {
                           return a.horizontal_m() < b.horizontal_m();
                         });
    if (largest != main.world->errors.end()) {
      all.push_back({"largest error", in_log_s(largest->stamp)});
    }
    return all;
  }

  void add_errors(report::HtmlPage* page) const {
    const evaluation::WorldMetrics& world = *reported_.front().world;
    page->heading("Error");
    if (reported_.size() > 1) page->plot(errors());
    page->paragraph(
        fmt::format("{}: errors and predicted sigmas of the world pose of WM, against the ground "
                    "truth (SIM_TRUTH) in {}. NEES per degree of freedom {:.2f}: squared error "
                    "normalized by the published covariance; 1 for a consistent covariance, more "
                    "for an overconfident one.",
                    names_.front(), truth_path_, world.nees_per_dof));
    page->table(evaluation::world_table(world));
    for (const report::Plot& p : evaluation::error_plots(world, outages_, zero())) page->plot(p);
  }

  void add_uncertainty(report::HtmlPage* page) const {
    page->heading("Uncertainty");
    const std::vector<report::Plot> plots = bounds();
    page->paragraph(plots.empty() ? "WM published no valid pose in frame world, hence no bounds."
                                  : evaluation::uncertainty_text());
    for (const report::Plot& p : plots) page->plot(p);
  }

  [[nodiscard]] Outcome write_page() const {
    const ReportedRun& main = reported_.front();
    if (!svg_.empty()) {
      std::vector<report::Plot> plots = {course()};
      if (main.world) plots.push_back(errors());
      if (!main.world) {
        for (report::Plot& p : bounds()) plots.push_back(std::move(p));
      }
      const std::string svg = report::render_stacked(plots);
      if (Outcome written = tools::write_text(svg_, svg); !written) return written;
    }
    report::HtmlPage page(outages_.empty() ? "Drive" : "Drive without GPS",
                          page_origin(main.trace.configuration.empty() ? "not recorded in the log"
                                                                       : main.trace.configuration));
    add_verdict(&page);
    if (!note_.empty()) page.paragraph(note_);
    page.paragraph(outage_text());
    page.table(evaluation::comparison_table(compared_));
    if (const std::string text = evaluation::comparison_text(compared_); !text.empty()) {
      page.paragraph(text);
    }
    page.moments(shell_word(main.log.path), moments());
    page.heading("Course");
    page.paragraph(fmt::format("Estimate in frame {}.",
                               main.world ? "world" : evaluation::frame_name(frame_)));
    page.plot(course());
    add_driving(main.log.path, &page);
    if (!main.trace.speed.empty()) {
      page.heading("Speed");
      page.plot(evaluation::speed_plot(main.trace, outages_, zero()));
    }
    if (main.world) add_errors(&page);
    if (!main.log.nav.empty()) add_uncertainty(&page);
    if (Result<report::CellMap> map = evaluation::read_map(main.log.path, scans_.poses)) {
      page.heading("Map");
      page.plot(evaluation::map_plot(std::move(map).value(), scans_.poses, frame_));
    }
    page.heading("Latencies");
    page.table(evaluation::latency_table(main.metrics));
    if (main.metrics.chain_ms) {
      page.plot(evaluation::latency_plot("From the last facet of a scan to nav_state",
                                         main.metrics.chain_samples_ms));
    }
    for (const report::Plot& p : evaluation::node_plots(main.log)) page.plot(p);
    page.heading("Registrations");
    page.table(evaluation::scan_table(main.metrics));
    return tools::write_text(out_, page.finish());
  }

  std::vector<std::string> runs_;
  std::string truth_log_;
  std::vector<double> gps_cut_s_;
  std::string out_;
  std::string svg_;
  double min_factor_ = 0.0;
  bool json_ = false;

  tools::Trajectory truth_;
  std::optional<Geodetic> truth_datum_;
  std::string truth_path_;
  std::string note_;                                   ///< what is left out, and the reason
  recording::Frame frame_ = recording::Frame::kWorld;  ///< of the poses of the first run
  recording::ScanPoses scans_;                         ///< of the first run
  std::vector<evaluation::TimeInterval> outages_;
  std::vector<std::string> names_;
  std::vector<ReportedRun> reported_;
  std::vector<evaluation::ComparedRun> compared_;
};

}  // namespace

void add_report_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<ReportCommand>(rcs));
}

}  // namespace rcs::cli
