// rcs table1

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "rcs/command_line/config_files.h"
#include "sim/scenario_file.h"
#include "tools/base/files.h"
#include "tools/base/statistics.h"
#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"
#include "tools/studies/cloud_match.h"
#include "tools/studies/figures/paper_figures.h"
#include "tools/studies/kitti_drive.h"
#include "tools/studies/scan_pairs.h"
#include "tools/studies/simulated_scans.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kTable1Name = "table1";
constexpr std::string_view kReference = "config/sim/reference.toml";

/// A row of Table 1 of the paper.
struct Printed {
  studies::DataSet set;
  const char* description;
  int model_points;
  int data_points;
  double mean_distance_cm;
  int iterations;
};
constexpr std::array<Printed, 4> kPrinted = {{
    {studies::DataSet::kConsecutive, "#1 consecutive scans", 4852, 4848, 5.77, 6},
    {studies::DataSet::kTwentyApart, "#2 20 scans apart", 5349, 5352, 4.64, 3},
    {studies::DataSet::kMovedBy1m, "#3 R(0) T(1) of #2", 5349, 5352, 4.64, 38},
    {studies::DataSet::kTurnedAndMovedBy3m, "#4 R(10) T(3) of #1", 4852, 4848, 11.66, 83},
}};

enum class Method { kLiteral, kCorrected, kProduction, kGlobal };
constexpr std::array<Method, 4> kMethods = {Method::kLiteral, Method::kCorrected,
                                            Method::kProduction, Method::kGlobal};

const char* name_of(Method method) {
  switch (method) {
    case Method::kLiteral:
      return "paper, as printed";
    case Method::kCorrected:
      return "paper, corrected";
    case Method::kProduction:
      return "plane";
    case Method::kGlobal:
      break;
  }
  return "plane, global";
}

studies::CloudMatch run_method(Method method, const Points& model, const Points& data,
                               const Pose& guess) {
  switch (method) {
    case Method::kLiteral:
      return studies::match_as_in_paper(model, data, guess, registration::PaperParams::literal());
    case Method::kCorrected:
      return studies::match_as_in_paper(model, data, guess, registration::PaperParams{});
    case Method::kProduction:
      return studies::match_planes(model, data, guess, registration::CloudParams{});
    case Method::kGlobal:
      break;
  }
  return studies::match_globally(model, data, guess, registration::CloudParams{});
}

struct Metrics {
  double model_points = 0.0;
  double data_points = 0.0;
  double mean_distance_before_cm = 0.0;  ///< of all data points to the closest model point
  double mean_distance_after_cm = 0.0;
  double mean_distance_of_pairs_cm = 0.0;  ///< of the final pairs of the method
  double iterations = 0.0;
  double error_m = 0.0;
  double error_deg = 0.0;
  double overlap = 0.0;
  double cpu_ms = 0.0;
};
struct NamedMetric {
  const char* name;
  double Metrics::*value;
};
constexpr std::array<NamedMetric, 10> kMetrics = {{
    {"model_points", &Metrics::model_points},
    {"data_points", &Metrics::data_points},
    {"mean_distance_before_cm", &Metrics::mean_distance_before_cm},
    {"mean_distance_after_cm", &Metrics::mean_distance_after_cm},
    {"mean_distance_of_pairs_cm", &Metrics::mean_distance_of_pairs_cm},
    {"iterations", &Metrics::iterations},
    {"error_m", &Metrics::error_m},
    {"error_deg", &Metrics::error_deg},
    {"overlap", &Metrics::overlap},
    {"cpu_ms", &Metrics::cpu_ms},
}};

/// A method on all trials of a data set.
struct Row {
  std::string scans;
  Method method;
  std::size_t trials = 0;
  int successes = 0;
  int unnoticed = 0;  ///< failures that the method reports as successes
  Metrics median;
};

Metrics metrics_of(const studies::CloudMatch& match, const Points& model, const Points& data,
                   const studies::Trial& trial) {
  const KdTree tree(model);
  const studies::Offset error = studies::error_of(trial.pair.T_model_data, match.T_model_data);
  Metrics f;
  f.model_points = static_cast<double>(model.size());
  f.data_points = static_cast<double>(data.size());
  f.mean_distance_before_cm = 100.0 * studies::closest_points(tree, data, trial.guess).mean_m();
  f.mean_distance_after_cm =
      100.0 * studies::closest_points(tree, data, match.T_model_data).mean_m();
  f.mean_distance_of_pairs_cm = 100.0 * match.mean_distance_of_pairs_m;
  f.iterations = match.iterations;
  f.error_m = error.m;
  f.error_deg = degrees(error.rad);
  f.overlap = match.overlap;
  f.cpu_ms = match.total_ms();
  return f;
}

Row run_row(const std::string& name, const studies::ScanSet& scans,
            const std::vector<studies::Trial>& trials, Method method,
            const std::function<void()>& tried) {
  Row row{name, method, trials.size(), 0, 0, {}};
  std::vector<Metrics> all;
  all.reserve(trials.size());
  for (const studies::Trial& t : trials) {
    const Points& model = scans.scans.at(t.pair.model);
    const Points& data = scans.scans.at(t.pair.data);
    const studies::CloudMatch match = run_method(method, model, data, t.guess);
    const bool success =
        studies::is_success(studies::error_of(t.pair.T_model_data, match.T_model_data));
    row.successes += success ? 1 : 0;
    row.unnoticed += !success && match.good ? 1 : 0;
    all.push_back(metrics_of(match, model, data, t));
    tried();
  }
  for (const NamedMetric& metric : kMetrics) {
    std::vector<double> values;
    values.reserve(all.size());
    for (const Metrics& f : all) values.push_back(f.*metric.value);
    row.median.*metric.value = tools::summarize(values).p50;
  }
  return row;
}

/// Three or four digits.
std::string short_number(double v) { return fmt::format("{:.{}f}", v, v < 100.0 ? 2 : 0); }

class Table1 final : public Command {
 public:
  explicit Table1(CLI::App* rcs)
      : Command(rcs->add_subcommand("table1", "Reproduce Table 1 of the paper, with true errors")) {
    app()
        ->add_option("--data", data_,
                     fmt::format("folder that contains {}; default: $RCS_DATA_DIR, or if "
                                 "it is unset simulated scans only",
                                 studies::kKittiDrive))
        ->check(CLI::ExistingDirectory);
    app()
        ->add_option("--scenario", scenario_,
                     fmt::format("scenario of the simulated scans; default: {}", kReference))
        ->transform(command_line::config_file());
    app()
        ->add_option("--pairs", pairs_, "number of pairs of simulated scans")
        ->check(CLI::Range(1, 50))
        ->capture_default_str();
    app()
        ->add_option("--seeds", seeds_, "number of starts of each pair in #2, #3 and #4")
        ->check(CLI::Range(1, 16))
        ->capture_default_str();
    CLI::Option* plot =
        app()
            ->add_option("--plot", plot_,
                         "folder for figures 2 and 3 of the paper from these scans: an SVG file "
                         "each, and index.html with all of them")
            ->type_name("FOLDER");
    app()
        ->add_option("--trial", trial_, "--plot: number of the trial of #1 and of #3, from 1")
        ->needs(plot)
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Each row: a method (Madhavan and Messina as printed, the same with its errors corrected,\n"
        "plane from the guess, plane without a guess) on pairs of scans with known\n"
        "motion: sweeps of KITTI cut to the 32 x 180 cells of the paper, and the reference\n"
        "simulation. Values are medians. #2 and #3 start 0.3 m and 1 deg from the truth, #3 with\n"
        "another 1 m along each axis; #1 and #4 start as in the paper.\n"
        "  ok          error below 0.1 m and 0.5 deg\n"
        "  false ok    not ok, although the method has accepted its result\n"
        "  cm          mean from a data point to the closest model point, before and after, of "
        "all\n"
        "              points, and of the pairs of the method (plane: along the normals)\n"
        "  pairs [%]   share of the data points that the method pairs\n"
        "The true motions of KITTI's cuts are those of the whole sweeps, deskewed, by generalized\n"
        "ICP; reference_pairs.csv, which assumes rigid sweeps, is only its guess: two of its six\n"
        "pairs 20 sweeps apart differ by 0.07 and 0.18 m.\n"
        "Figures 2 and 3 are trials of #1 and #3, by the method of the paper, corrected, and by\n"
        "plane: 2 (a), (b) the two range images with the vehicle, (c) after registration, (d)\n"
        "closest-point distances before and after; 3 (a), (b) before and after, (c) the pairs of\n"
        "closest points midway, magnified, (d) as 2 (d). They are written before the trials run.\n"
        "Examples:\n"
        "  rcs table1 --seeds 16 --json > table1.json\n"
        "  rcs table1 --plot out/figures");
  }

  int run() override {
    const InterruptGuard interrupt;  // the unpacked sweeps are removed
    const bool named = !data_.empty();
    const char* const environment = std::getenv("RCS_DATA_DIR");
    if (data_.empty() && environment != nullptr) data_ = environment;
    std::optional<studies::ScanSet> cuts;
    if (data_.empty()) {
      fmt::print(stderr, "rcs table1: without real scans: RCS_DATA_DIR is not set; {}\n", remedy());
    } else {
      Progress progress(kTable1Name, Progress::kSteps);  // the archive is unpacked
      Result<studies::ScanSet> read = read_cuts(data_ + "/" + std::string(studies::kKittiDrive));
      if (read) {
        cuts = std::move(read).value();
      } else if (named || interrupt.requested()) {
        return fail(kTable1Name, read.error());
      } else {
        fmt::print(stderr, "rcs table1: without real scans: RCS_DATA_DIR={}: {}; {}\n", data_,
                   read.error().message, remedy());
      }
    }
    const std::string path =
        scenario_.empty() ? command_line::find_config(std::string(kReference)) : scenario_;
    const Result<sim::Scenario> scenario = sim::load_scenario(path, {});
    if (!scenario) return fail(kTable1Name, scenario.error());
    if (scenario->ladar != sim::LadarKind::kImager || scenario->commanded) {
      return fail(kTable1Name, Error{path + ": not a scripted drive with a range imager"});
    }
    const studies::ScanSet simulated = simulate(*scenario);
    if (!plot_.empty()) {
      std::vector<Scans> drawn;
      if (cuts) drawn.push_back({studies::kitti_source(), &*cuts});
      drawn.push_back({studies::simulation_source(*scenario, path), &simulated});
      if (const int status = draw(drawn); status != kExitOk) return status;
    }
    const std::vector<std::vector<Row>> rows = rows_of(cuts, simulated, interrupt);
    if (interrupt.requested()) return fail(kTable1Name, Error{"interrupted"});
    json_ ? print_json(rows) : print_table(rows);
    return kExitOk;
  }

 private:
  static std::string remedy() {
    return fmt::format(
        "set RCS_DATA_DIR (or --data) to the folder that contains {} with reference_pairs.csv and "
        "the sweeps (docs/user/drills_and_evaluation.md)",
        studies::kKittiDrive);
  }

  [[nodiscard]] studies::ScanSet simulate(const sim::Scenario& scenario) const {
    const Progress progress(kTable1Name, Progress::kSteps);
    return studies::simulate_scans(scenario, pairs_);
  }

  struct Scans {
    studies::FigureSource source;
    const studies::ScanSet* set = nullptr;
  };
  /// @return exit status
  [[nodiscard]] int draw(std::vector<Scans> drawn) const {
    std::vector<studies::FigureSet> sets;
    for (Scans& scans : drawn) {
      const std::vector<studies::ScanPair>& pairs = scans.set->pairs;
      const auto two = studies::trials_of(studies::DataSet::kConsecutive, pairs, seeds_);
      const auto three = studies::trials_of(studies::DataSet::kMovedBy1m, pairs, seeds_);
      const auto k = static_cast<std::size_t>(trial_ - 1);
      if (k >= two.size() || k >= three.size()) {
        return wrong_usage(kTable1Name,
                           Error{fmt::format("--trial {}: {} has {} trials of #1 and {} of #3",
                                             trial_, scans.source.name, two.size(), three.size())});
      }
      sets.push_back(studies::paper_figures(std::move(scans.source), *scans.set, two[k], three[k]));
    }
    for (const studies::FigureSet& set : sets) {
      for (const studies::PaperFigure& figure : set.figures) {
        const Outcome written =
            tools::write_text(plot_ + "/" + figure.file, report::render_stacked(figure.plots));
        if (!written) return fail(kTable1Name, written.error());
      }
    }
    const std::string page = plot_ + "/index.html";
    const Outcome written =
        tools::write_text(page, studies::paper_figures_page(sets, page_origin()));
    if (!written) return fail(kTable1Name, written.error());
    fmt::print(stderr, "rcs table1: {}\n", page);
    return kExitOk;
  }

  /// Incomplete after Ctrl-C.
  [[nodiscard]] std::vector<std::vector<Row>> rows_of(const std::optional<studies::ScanSet>& cuts,
                                                      const studies::ScanSet& simulated,
                                                      const InterruptGuard& interrupt) const {
    Progress progress(kTable1Name, Progress::kSteps);
    std::size_t all = 0;
    std::size_t done = 0;
    for (const Printed& printed : kPrinted) {
      if (cuts) all += studies::trials_of(printed.set, cuts->pairs, seeds_).size();
      all += studies::trials_of(printed.set, simulated.pairs, seeds_).size();
    }
    std::vector<std::vector<Row>> rows;
    for (const Printed& printed : kPrinted) {
      std::vector<Row>& of_set = rows.emplace_back();
      const auto add = [&](const char* name, const studies::ScanSet& scans) {
        const std::vector<studies::Trial> trials =
            studies::trials_of(printed.set, scans.pairs, seeds_);
        for (const Method method : kMethods) {
          if (interrupt.requested()) return;
          of_set.push_back(run_row(name, scans, trials, method, [&] {
            progress.at_share(static_cast<double>(++done) /
                              static_cast<double>(all * kMethods.size()));
          }));
        }
      };
      if (cuts) add("KITTI", *cuts);
      add("simulation", simulated);
    }
    return rows;
  }

  static Result<studies::ScanSet> read_cuts(const std::string& folder) {
    const Result<studies::KittiDrive> drive = studies::KittiDrive::open(folder);
    if (!drive) return drive.error();
    const Result<std::vector<studies::ScanPair>> pairs = drive->deskewed(drive->references());
    if (!pairs) return pairs.error();
    return drive->real_cuts(*pairs);
  }

  static void print_table(const std::vector<std::vector<Row>>& rows) {
    report::Table table{
        {"", "points M/D", "ok", "false ok", "before [cm]", "after [cm]", "pairs [cm]", "iter.",
         "error [m]", "error [deg]", "pairs [%]", "CPU [ms]"},
        {}};
    for (std::size_t set = 0; set < kPrinted.size(); ++set) {
      const Printed& p = kPrinted[set];
      table.rows.push_back({p.description, fmt::format("{}/{}", p.model_points, p.data_points), "",
                            "", "", fmt::format("{:.2f}", p.mean_distance_cm), "",
                            fmt::format("{}", p.iterations), "", "", "", ""});
      std::string scans;
      for (const Row& row : rows[set]) {
        if (row.scans != scans) {
          scans = row.scans;
          std::vector<std::string> title(table.header.size());
          title[0] = fmt::format(" {}: {}", scans, row.trials);
          table.rows.push_back(std::move(title));
        }
        const Metrics& m = row.median;
        table.rows.push_back(
            {fmt::format("  {}", name_of(row.method)),
             fmt::format("{:.0f}/{:.0f}", m.model_points, m.data_points),
             fmt::format("{}", row.successes), fmt::format("{}", row.unnoticed),
             short_number(m.mean_distance_before_cm), short_number(m.mean_distance_after_cm),
             short_number(m.mean_distance_of_pairs_cm), fmt::format("{:.0f}", m.iterations),
             fmt::format("{:.3f}", m.error_m), fmt::format("{:.2f}", m.error_deg),
             fmt::format("{:.0f}", 100.0 * m.overlap),
             fmt::format("{:.{}f}", m.cpu_ms, m.cpu_ms < 100.0 ? 1 : 0)});
      }
    }
    const bool real = !rows.front().empty() && rows.front().front().scans == "KITTI";
    table.note = fmt::format(
        "rows #1 to #4: as printed in the paper, of its own scans. {}simulation: N trials on scans "
        "of the reference simulation, whose motion is known exactly. Values are medians. M, D: "
        "points of model and data; ok: trials with an error below 0.1 m and 0.5 deg; false ok: "
        "other trials that the method reports as successes; before, after, pairs: mean distance of "
        "the data points, and of the paired ones, to the model; pairs [%]: share of the data "
        "points. "
        "More: rcs table1 --help",
        real ? "KITTI: N trials on sweeps of drive 0005, cut to the size of the paper. " : "");
    fmt::print("{}", to_text(table));
  }

  static void print_json(const std::vector<std::vector<Row>>& rows) {
    report::Json sets = report::Json::array();
    for (std::size_t set = 0; set < kPrinted.size(); ++set) {
      const Printed& p = kPrinted[set];
      report::Json ours = report::Json::array();
      for (const Row& row : rows[set]) {
        report::Json j = {{"scans", row.scans},
                          {"method", name_of(row.method)},
                          {"trials", row.trials},
                          {"successes", row.successes},
                          {"unnoticed", row.unnoticed}};
        for (const NamedMetric& metric : kMetrics) j[metric.name] = row.median.*metric.value;
        ours.push_back(j);
      }
      sets.push_back({{"set", p.description},
                      {"paper",
                       {{"model_points", p.model_points},
                        {"data_points", p.data_points},
                        {"mean_distance_after_cm", p.mean_distance_cm},
                        {"iterations", p.iterations}}},
                      {"methods", ours}});
    }
    fmt::print("{}", report::json_document(kTable1Name, {{"sets", sets}}));
  }

  std::string data_;
  std::string scenario_;
  int pairs_ = 8;
  int seeds_ = 4;
  std::string plot_;
  int trial_ = 1;
  bool json_ = false;
};

}  // namespace

void add_table1_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Table1>(rcs));
}

}  // namespace rcs::cli
