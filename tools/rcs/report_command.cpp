// rcs report

#include <fmt/format.h>

#include "tools/rcs/command.h"
#include "tools/rcs/evaluation_tables.h"
#include "tools/rcs/figures.h"
#include "tools/rcs/files.h"
#include "tools/rcs/html_page.h"

namespace rcs::tools {
namespace {

constexpr std::string_view kName = "report";

struct ComparedRun {
  std::string name;
  RunLog log;
  RunFigures figures;
  WorldFigures world;
  Summary with_gps_m;  ///< horizontal, outside the outages
  std::vector<OutageFigures> outages;
};

std::string fixed(double v, int digits) { return fmt::format("{:.{}f}", v, digits); }

class ReportCommand final : public Command {
 public:
  explicit ReportCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand("report", "Compare runs of one drive whose truth is known")) {
    app()
        ->add_option("RUN,--run", runs_, "[NAME=]LOG; the first is the one that is shown in full")
        ->required();
    app()
        ->add_option("--truth-log", truth_log_,
                     "log with SIM_TRUTH; default: the first run, when it has that")
        ->check(CLI::ExistingFile);
    app()->add_option("--gps-cut", gps_cut_,
                      "A:B, seconds after the first truth; default: where the first run's WM took\n"
                      "no fix for longer than 2.5 s");
    app()->add_option("-o,--out", out_, "self-contained HTML page")->required();
    app()->add_option("--svg", svg_, "the picture of the course alone");
    app()->add_flag("--json", json_, "figures as JSON");
    app()->footer(
        "Example:\n"
        "  rcs replay config/demo3.toml run.log -o ins.log --without LADAR_RANGES,ODOMETRY\n"
        "  rcs report \"all sensors=run.log\" \"inertial alone=ins.log\" -o report.html");
  }

  int run() override {
    const Outcome read = read_runs();
    if (!read) return fail(kName, read.error());
    print_figures();
    const Outcome written = write_page();
    return written ? kExitOk : fail(kName, written.error());
  }

 private:
  Outcome read_runs() {
    if (!truth_log_.empty()) {
      Result<RunLog> truth = read_run(truth_log_);
      if (!truth) return truth.error();
      truth_ = std::move(truth->truth);
      truth_datum_ = truth->truth_datum;
    }
    for (const std::string& run : runs_) {
      const std::size_t equals = run.find('=');
      const std::string path = equals == std::string::npos ? run : run.substr(equals + 1);
      Result<RunLog> log = read_run(path);
      if (!log) return log.error();
      if (!log->damage.empty()) fmt::print(stderr, "rcs report: {}: {}\n", path, log->damage);
      if (truth_.empty()) {
        truth_ = log->truth;
        truth_datum_ = log->truth_datum;
      }
      if (truth_.empty()) return Error{path + ": no SIM_TRUTH; --truth-log names a log with it"};
      if (compared_.empty()) {
        if (Outcome outages = find_outages(*log); !outages) return outages;
      }
      std::optional<WorldFigures> world = world_figures(*log, truth_, truth_datum_);
      if (!world) return Error{path + ": no world pose of WM at a time of the truth"};
      ComparedRun compared;
      compared.name = equals == std::string::npos ? path : run.substr(0, equals);
      compared.figures = run_figures(*log);
      std::vector<double> with_gps_m;
      for (const WorldError& e : world->errors) {
        if (!in_outage(e.stamp)) with_gps_m.push_back(e.horizontal_m());
      }
      compared.with_gps_m = summarize(std::move(with_gps_m));
      for (const TimeInterval& i : outages_) compared.outages.push_back(outage_figures(*world, i));
      compared.log = std::move(log).value();
      compared.world = std::move(*world);
      compared_.push_back(std::move(compared));
    }
    return Done{};
  }

  Outcome find_outages(const RunLog& first) {
    if (gps_cut_.empty()) {
      outages_ = gps_outages(first);
      return Done{};
    }
    std::string text = gps_cut_;
    if (const std::size_t colon = text.find(':'); colon != std::string::npos) text[colon] = ' ';
    const std::optional<std::vector<double>> v = parse_numbers(text);
    if (!v || v->size() != 2 || (*v)[1] <= (*v)[0]) {
      return Error{"--gps-cut " + gps_cut_ + ": expected A:B, two times in seconds"};
    }
    outages_ = {{zero() + from_seconds((*v)[0]), zero() + from_seconds((*v)[1])}};
    return Done{};
  }

  [[nodiscard]] Stamp zero() const { return truth_.front().stamp; }
  [[nodiscard]] bool in_outage(Stamp stamp) const {
    for (const TimeInterval& i : outages_) {
      if (i.contains(stamp)) return true;
    }
    return false;
  }

  [[nodiscard]] Table comparison_table() const {
    Table t{{"horizontal error [m]", "with GPS, rms", "with GPS, max", "without, max",
             "without, at its end", "drift", "NEES/dof"},
            {}};
    for (const ComparedRun& c : compared_) {
      if (c.outages.empty()) {
        t.rows.push_back({c.name, fixed(c.with_gps_m.rms, 2), fixed(c.with_gps_m.max, 2), "-", "-",
                          "-", fixed(c.world.nees_per_dof, 2)});
      }
      for (const OutageFigures& o : c.outages) {
        t.rows.push_back({c.name, fixed(c.with_gps_m.rms, 2), fixed(c.with_gps_m.max, 2),
                          fixed(o.max_horizontal_m, 2), fixed(o.end_horizontal_m, 2),
                          fixed(o.drift_percent, 2) + " %", fixed(c.world.nees_per_dof, 2)});
      }
    }
    return t;
  }

  [[nodiscard]] std::string outage_text() const {
    std::string text;
    for (const OutageFigures& o : compared_.front().outages) {
      text += fmt::format("GPS denied from {:.0f} s to {:.0f} s, over {:.0f} m. ",
                          seconds(o.interval.from - zero()), seconds(o.interval.to - zero()),
                          o.driven_m);
    }
    return text + "Drift: error at the end of the outage in percent of the distance driven in it.";
  }

  void print_figures() const {
    if (json_) {
      Json json = {{"runs", Json::array()}};
      for (const ComparedRun& c : compared_) {
        Json run = {{"name", c.name},
                    {"log", c.log.path},
                    {"with_gps_horizontal_rms_m", c.with_gps_m.rms},
                    {"with_gps_horizontal_max_m", c.with_gps_m.max},
                    {"world", to_json(c.world)},
                    {"outages", Json::array()},
                    {"figures", to_json(c.figures)}};
        for (const OutageFigures& o : c.outages) run["outages"].push_back(to_json(o, zero()));
        json["runs"].push_back(run);
      }
      fmt::print("{}\n", json.dump(2));
      return;
    }
    fmt::print("{}\n{}\n\n{}\n{}", outage_text(), to_text(comparison_table()),
               to_text(latency_table(compared_.front().figures)),
               to_text(scan_table(compared_.front().figures)));
  }

  [[nodiscard]] Plot course() const {
    std::vector<NamedTrajectory> estimates;
    for (const ComparedRun& c : compared_) {
      NamedTrajectory estimate{c.name, {}};
      for (const WorldError& e : c.world.errors) {
        estimate.poses.push_back({e.stamp, e.T_truthworld_vehicle});
      }
      estimates.push_back(std::move(estimate));
    }
    return course_plot(truth_, estimates, outages_, Frame::kWorld);
  }

  [[nodiscard]] Outcome write_page() const {
    const ComparedRun& main = compared_.front();
    if (!svg_.empty()) {
      if (Outcome written = write_text(svg_, render(course(), true)); !written) return written;
    }
    HtmlPage page("Drive without GPS");
    page.paragraph(outage_text());
    page.table(comparison_table());
    page.heading("Course");
    page.plot(course());
    page.heading("Error");
    if (compared_.size() > 1) {
      std::vector<std::pair<std::string, const WorldFigures*>> runs;
      for (const ComparedRun& c : compared_) runs.emplace_back(c.name, &c.world);
      page.plot(comparison_plot(runs, outages_, zero()));
    }
    page.paragraph(
        fmt::format("{}: what WM claims against what is true. NEES per degree of "
                    "freedom {:.2f}; 1 when the covariance tells the truth.",
                    main.name, main.world.nees_per_dof));
    page.table(world_table(main.world));
    for (const Plot& p : error_plots(main.world, outages_, zero())) page.plot(p);

    if (const Result<ScanPoses> scans = poses_at_scans(main.log, Frame::kWorld)) {
      if (Result<CellMap> map = read_map(main.log.path, scans->poses)) {
        page.heading("Map");
        page.plot(map_plot(std::move(map).value(), scans->poses, Frame::kWorld));
      }
    }
    page.heading("Latencies");
    page.table(latency_table(main.figures));
    if (main.figures.chain_ms) {
      page.plot(
          latency_plot("From a scan's last facet to nav_state", main.figures.chain_samples_ms));
    }
    for (const Plot& p : node_plots(main.log)) page.plot(p);
    page.heading("Registrations");
    page.table(scan_table(main.figures));
    return write_text(out_, page.finish());
  }

  std::vector<std::string> runs_;
  std::string truth_log_;
  std::string gps_cut_;
  std::string out_;
  std::string svg_;
  bool json_ = false;

  Trajectory truth_;
  std::optional<Geodetic> truth_datum_;
  std::vector<TimeInterval> outages_;
  std::vector<ComparedRun> compared_;
};

}  // namespace

void add_report_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<ReportCommand>(rcs));
}

}  // namespace rcs::tools
