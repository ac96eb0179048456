// rcs predict

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/base/random_places.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kPredictName = "predict";
constexpr Duration kResend = from_seconds(1.0);

class PredictCommand final : public Command {
 public:
  explicit PredictCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "predict", "Predict the position uncertainty of WM along a path without GPS")) {
    CLI::Option* const to =
        add_repeated(app(), "--to", &to_, "point of the path, east and north in frame world [m]")
            ->type_name("X,Y");
    app()
        ->add_option("--path", path_, "CSV with columns x_m and y_m, in frame world")
        ->check(CLI::ExistingFile)
        ->excludes(to);
    app()
        ->add_option("--limit", limit_m_, "status 1 if the sigma with the map exceeds this [m]")
        ->check(CLI::Range(0.01, 1e4));
    app()
        ->add_option("--rows", rows_, "maximum number of rows of the table")
        ->check(CLI::Range(2, 1000))
        ->capture_default_str();
    app()
        ->add_option("--timeout", timeout_s_,
                     "time limit for the response of WM [s]; when exceeded: status 3")
        ->check(CLI::Range(0.1, 3600.0))
        ->capture_default_str();
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--json", json_, "print the result as JSON, with every point");
    app()->footer(
        "The path begins at the vehicle. Sigmas are of the position in the worst horizontal\n"
        "direction; the sigma with the map does not include the systematic error of the survey. "
        "WM\n"
        "computes the prediction in the background, about 1.2 km of path per second.\n"
        "Examples:\n"
        "  rcs predict --to 400,120 --to 900,300\n"
        "  rcs predict --path route.csv --limit 2");
  }

  int run() override {
    const Result<std::vector<Vec2>> places = checked_places();
    if (!places) {
      return path_.empty() ? wrong_usage(kPredictName, places.error())
                           : fail(kPredictName, places.error());
    }
    const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(lcm_url_);
    if (!bus) return fail(kPredictName, bus.error());
    const Result<path_uncertainty_t> answer = ask(bus->get(), *places);
    if (!answer) return fail(kPredictName, answer.error());
    if (answer->state == path_uncertainty_t::STATE_NO_WORLD) {
      return fail(kPredictName, Error{"WM has no world pose yet"});
    }
    if (answer->state != path_uncertainty_t::STATE_ANSWERED) {
      return fail(kPredictName,
                  Error{"WM rejected the path: at most 1000 points, within 10000 km"});
    }
    if (answer->n < 1) return fail(kPredictName, Error{"the response has no points"});
    if (json_) {
      print_json(*answer);
    } else {
      print_table(*answer);
    }
    const float most =
        *std::max_element(answer->sigma_with_map_m.begin(), answer->sigma_with_map_m.end());
    if (!limit_m_ || most <= *limit_m_) return kExitOk;
    return negative(kPredictName,
                    Error{fmt::format("sigma {:.2f} m > {:.2f} m (--limit)", most, *limit_m_)});
  }

 private:
  [[nodiscard]] Result<std::vector<Vec2>> read_places() const {
    if (!path_.empty()) return tools::load_places(path_);
    std::vector<Vec2> places;
    for (const std::string& text : to_) {
      const std::optional<Vec2> p = tools::parse_place(text);
      if (!p) return Error{"--to " + text + ": expected X,Y in metres"};
      places.push_back(*p);
    }
    return places;
  }

  [[nodiscard]] Result<std::vector<Vec2>> checked_places() const {
    constexpr std::size_t kMax = 1000;  // limit of WM
    Result<std::vector<Vec2>> places = read_places();
    if (!places) return places;
    const std::string from = path_.empty() ? "" : path_ + ": ";
    if (places->empty()) return Error{from + "a path is required: --to or --path with points"};
    if (places->size() > kMax) {
      return Error{fmt::format("{}{} points, at most {}", from, places->size(), kMax)};
    }
    return places;
  }

  [[nodiscard]] Result<path_uncertainty_t> ask(LcmBus* bus, const std::vector<Vec2>& places) const {
    StopSignals stop;
    LiveTimeline timeline(bus, &stop);
    Outbox<path_query_t> queries(bus, channel::kWmPathQuery);
    Inbox<path_uncertainty_t> answers(bus, channel::kWmPathUncertainty, 4);
    const Stamp begin = timeline.now();
    path_query_t query{};
    query.utime = query.serial = to_utime(begin);
    query.issuer = fmt::format("rcs predict {}", getpid());
    query.n = static_cast<std::int32_t>(places.size());
    for (const Vec2& p : places) {
      query.x_m.push_back(p.x());
      query.y_m.push_back(p.y());
    }
    Stamp send_at = begin;
    while (timeline.now() - begin < from_seconds(timeout_s_)) {
      if (timeline.now() >= send_at) {
        queries.publish(&query);
        send_at = timeline.now() + kResend;
      }
      const Stamp until = std::min(send_at, begin + from_seconds(timeout_s_));
      if (timeline.advance(until) == Timeline::Step::kEnded) {
        if (const Outcome status = bus->status(); !status) return status.error();
        note_interrupt();
        return Error{"interrupted"};
      }
      for (; !answers.empty(); answers.pop()) {
        const path_uncertainty_t& m = *answers.front();
        if (m.issuer == query.issuer && m.serial == query.serial) return m;
      }
    }
    return Error{fmt::format("no response within {} s: WM may not run on this bus", timeout_s_)};
  }

  static void print_json(const path_uncertainty_t& m) {
    report::Json points = report::Json::array();
    for (std::size_t k = 0; k < m.travelled_m.size(); ++k) {
      points.push_back({{"travelled_m", m.travelled_m[k]},
                        {"x_m", m.x_m[k]},
                        {"y_m", m.y_m[k]},
                        {"sigma_dead_reckoning_m", m.sigma_dead_reckoning_m[k]},
                        {"sigma_with_map_m", m.sigma_with_map_m[k]}});
    }
    const report::Json j = {{"utime", m.utime},
                            {"has_map", m.has_map != 0},
                            {"map_bias_sigma_m", m.map_bias_sigma_m},
                            {"points", points}};
    fmt::print("{}", report::json_document(kPredictName, j));
  }

  // At most `rows_` rows, evenly distributed, including the first and the last.
  void print_table(const path_uncertainty_t& m) const {
    report::Table table{
        {"distance [m]", "x [m]", "y [m]", "sigma, dead reckoning [m]", "with map [m]"}, {}};
    const std::size_t n = m.travelled_m.size();
    const std::size_t rows = std::min(n, static_cast<std::size_t>(rows_));
    for (std::size_t row = 0; row < rows; ++row) {
      const std::size_t k = rows == 1 ? 0 : row * (n - 1) / (rows - 1);
      table.rows.push_back({fmt::format("{:.0f}", m.travelled_m[k]),
                            fmt::format("{:.0f}", m.x_m[k]), fmt::format("{:.0f}", m.y_m[k]),
                            fmt::format("{:.2f}", m.sigma_dead_reckoning_m[k]),
                            fmt::format("{:.2f}", m.sigma_with_map_m[k])});
    }
    fmt::print("{}", to_text(table));
    if (m.has_map == 0) {
      fmt::print("WM has no a priori map: both sigmas are by dead reckoning\n");
    } else {
      fmt::print("not included with map: systematic error of the survey, sigma {:.2f} m\n",
                 m.map_bias_sigma_m);
    }
  }

  std::vector<std::string> to_;
  std::string path_;
  std::optional<double> limit_m_;
  int rows_ = 12;
  double timeout_s_ = 30.0;
  bool json_ = false;
  std::string lcm_url_;
};

}  // namespace

void add_predict_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<PredictCommand>(rcs));
}

}  // namespace rcs::cli
