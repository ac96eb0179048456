// rcs drive

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <numeric>
#include <thread>

#include "lcmtypes/rcs/command_t.hpp"
#include "rcs/command_line/config_files.h"
#include "tools/base/files.h"
#include "tools/driving/drive_output.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kDriveName = "drive";
constexpr std::int64_t kMaxDrives = 10'000;

/// "3", or "401..420". @return empty: neither, or too many
std::vector<std::int64_t> seeds_from(std::string_view text) {
  const auto number = [](std::string_view part) -> std::int64_t {
    std::int64_t value = -1;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size() ? value : -1;
  };
  const std::size_t dots = text.find("..");
  const std::int64_t first = number(text.substr(0, dots));
  const std::int64_t last = dots == std::string_view::npos ? first : number(text.substr(dots + 2));
  if (first < 0 || last < first || last - first >= kMaxDrives) return {};
  std::vector<std::int64_t> seeds(static_cast<std::size_t>(last - first + 1));
  std::iota(seeds.begin(), seeds.end(), first);
  return seeds;
}

class DriveCommand final : public Command {
 public:
  explicit DriveCommand(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "drive", "Drive simulated courses with SP, WM and BG, and count every contact")) {
    app()
        ->add_option("SCENARIO", scenario_, "scenario with [drive] mode = \"commanded\"")
        ->transform(command_line::config_file())
        ->capture_default_str();
    app()
        ->add_option(
            "--seeds", seeds_,
            "seed, or range of seeds A..B, of the noise, the hazards and, unless the scenario\n"
            "fixes it, the terrain")
        ->type_name("SEEDS")
        ->check([](const std::string& text) {
          return seeds_from(text).empty()
                     ? "expected a seed, or A..B with at most 10000 seeds, not " + text
                     : std::string();
        })
        ->capture_default_str();
    app()
        ->add_option("--config", config_, "the vehicle's configuration")
        ->type_name("FILE")
        ->capture_default_str();
    app()
        ->add_option("--gps-lost-after", gps_lost_after_m_, "distance after which GPS ends [m]")
        ->check(CLI::NonNegativeNumber);
    app()->add_flag("--losses", losses_,
                    "three losses of GPS, LADAR, INS or wheels in each drive, of 2 to 60 s, drawn\n"
                    "by the seed");
    app()
        ->add_option("--alert-limit", alert_limit_m_,
                     "horizontal alert limit of the task [m]; default: that of the vehicle")
        ->check(CLI::Range(0.1, 1000.0));
    app()
        ->add_option("--duration", duration_s_,
                     "end of each drive [s]; default: that of the scenario")
        ->check(CLI::Range(1.0, 86400.0));
    app()->add_flag("--local", local_,
                    "command the waypoints in frame local, as if their world positions were "
                    "unknown");
    app()
        ->add_option("--mission", mission_,
                     "visit: the mission node visits the waypoints on routes that it chooses;\n"
                     "return: and then returns to the start")
        ->type_name("TASK")
        ->check(CLI::IsMember({"visit", "return"}));
    app()
        ->add_option("--jobs", jobs_, "parallel drives; default: one per core")
        ->check(CLI::Range(1, 256));
    CLI::Option* const out =
        app()
            ->add_option("-o,--out", out_,
                         "folder for drives.json and a picture of each drive (drive_SEED.svg)")
            ->type_name("FOLDER");
    app()->add_flag("--logs", logs_, "also write a log of each drive (drive_SEED.log)")->needs(out);
    app()
        ->add_flag("--prior-map", prior_map_,
                   "give the vehicle the survey of the scenario ([prior_map]) as its a priori map\n"
                   "(drive_SEED_map)")
        ->needs(out);
    app()
        ->add_flag("--zones", zones_,
                   "a fence around the course, and a keep-out on each leg but the first, drawn by\n"
                   "the seed (drive_SEED_zones.geojson)")
        ->needs(out);
    app()
        ->add_option(
            "--zones-file", zones_file_,
            "operating zones of all drives (GeoJSON), judged by the true outline; not with\n"
            "--zones")
        ->type_name("FILE")
        ->excludes("--zones");
    app()->add_flag("--json", json_, "print the results as JSON on stdout");
    app()->footer(
        "The simulator, SP, WM and BG run in lockstep, as fast as they can: the same scenario and\n"
        "seed give the same drive. An operator commands the waypoints of the course. The ground\n"
        "truth counts every contact: a wheel at an edge, ground against the body, a tilt beyond\n"
        "the limit, a rock, a trunk or a moving actor. An actor that runs into the vehicle, which\n"
        "had been at rest for a second, is counted separately. With --losses the table also has\n"
        "what the vehicle did at its alert limits.\n"
        "Exit status 1 if a drive has a contact, does not arrive, stops late at an alert limit, "
        "or\n"
        "enters a zone.\n"
        "Examples:\n"
        "  rcs drive config/sim/closed_loop.toml --seeds 401..410 -o out/drives\n"
        "  rcs drive config/sim/hazards.toml --seeds 501..503 --gps-lost-after 100\n"
        "  rcs drive config/sim/actors.toml --seeds 901..910\n"
        "  rcs drive config/sim/return.toml --mission return --gps-lost-after 100\n"
        "  rcs drive config/sim/mission.toml --mission visit --prior-map -o out/mission\n"
        "  rcs drive config/sim/hazards.toml --seeds 801..840 --losses --alert-limit 3\n"
        "  rcs drive config/sim/closed_loop.toml --seeds 321..340 --zones -o out/zones\n"
        "  rcs drive config/sim/hazards.toml --seeds 7 --logs -o out/drive7\n"
        "  rcs why out/drive7/drive_7.log 60");
  }

  int run() override {
    scenario_ = command_line::find_config(scenario_);
    config_ = command_line::find_config(config_);
    if (!zones_file_.empty()) zones_file_ = command_line::find_config(zones_file_);
    const Outcome done = run_all();
    if (!done) return fail(kDriveName, done.error());
    const auto good = [](const driving::DriveRow& row) { return driving::passed(row.run); };
    return std::all_of(rows_.begin(), rows_.end(), good) ? kExitOk : kExitNegative;
  }

 private:
  Outcome run_all() {
    if (!out_.empty()) {
      std::error_code error;
      std::filesystem::create_directories(out_, error);
      if (error) return Error{out_ + ": " + error.message()};
    }
    const InterruptGuard interrupt;
    Progress bar(kDriveName, Progress::kSteps);
    driving::DriveCampaign campaign;
    campaign.scenario = scenario_;
    campaign.vehicle_config = config_;
    campaign.frame = local_ ? command_t::FRAME_LOCAL : command_t::FRAME_WORLD;
    campaign.level = mission_ == "visit"    ? driving::Level::kVisit
                     : mission_ == "return" ? driving::Level::kVisitReturn
                                            : driving::Level::kBg;
    campaign.seeds = seeds_from(seeds_);
    campaign.gps_lost_after_m = gps_lost_after_m_;
    campaign.losses = losses_;
    campaign.zones = zones_;
    campaign.zones_file = zones_file_;
    campaign.prior_map = prior_map_;
    campaign.alert_limit_m = alert_limit_m_;
    campaign.duration_s = duration_s_;
    campaign.out_folder = out_;
    campaign.logs = logs_;
    campaign.jobs = jobs_ > 0 ? static_cast<std::size_t>(jobs_)
                              : std::max<std::size_t>(1, std::thread::hardware_concurrency());
    campaign.stop = [&interrupt] { return interrupt.requested(); };
    campaign.progress = [&bar](double share) { bar.at_share(share); };
    Result<std::vector<driving::DriveRow>> rows = driving::run_drives(campaign);
    if (!rows) return rows.error();
    rows_ = std::move(rows).value();
    return print_results();
  }

  [[nodiscard]] Outcome print_results() const {
    const std::string json = report::json_document(kDriveName, driving::to_json(rows_));
    if (json_) {
      fmt::print("{}", json);
    } else {
      fmt::print("{}{}", to_text(driving::drive_table(rows_)), driving::drive_summary(rows_));
    }
    return out_.empty() ? Outcome(Done{}) : tools::write_text(out_ + "/drives.json", json);
  }

  std::string scenario_ = "config/sim/closed_loop.toml";
  std::string seeds_ = "1";
  std::string config_ = "config/demo3.toml";
  std::optional<double> gps_lost_after_m_;
  std::optional<double> duration_s_;
  double alert_limit_m_ = 0.0;
  bool losses_ = false;
  bool zones_ = false;
  std::string zones_file_;
  bool prior_map_ = false;
  bool local_ = false;
  std::string mission_;
  int jobs_ = 0;
  std::string out_;
  bool logs_ = false;
  bool json_ = false;
  std::vector<driving::DriveRow> rows_;
};

}  // namespace

void add_drive_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<DriveCommand>(rcs));
}

}  // namespace rcs::cli
