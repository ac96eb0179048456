#include "tests/live_faults/vehicle_run.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <system_error>

#include "rcs/node/report.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kLook = from_seconds(0.02);        // interval of checks of the processes
constexpr Duration kBeforeFirst = from_seconds(5.0);  // WM levels at rest
constexpr Duration kAskAgain = from_seconds(0.5);     // after a rejected command
constexpr Duration kStopWithin = from_seconds(6.0);

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): one thread
  return value == nullptr ? "." : value;
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

void replace(std::string* text, const std::string& what, const std::string& with) {
  const std::size_t at = text->find(what);
  if (at != std::string::npos) text->replace(at, what.size(), with);
}

}  // namespace

// The area around a waypoint is free of obstacles: the first one removes a rock at (66.6, 4.6) that
// is 1 cm higher than the limit for a collision and that no driver here can distinguish from the
// grass around it.
const std::vector<Vec2>& course_world() {
  static const std::vector<Vec2> course = {{63, 2},    {120, 30}, {190, 20}, {250, 70}, {230, 150},
                                           {150, 170}, {60, 140}, {10, 70},  {0, 0}};
  return course;
}

VehicleRun::VehicleRun(const std::string& vehicle_toml,
                       const std::vector<std::string>& sim_arguments) {
  folder_ = std::filesystem::temp_directory_path() / "rcs_drill_XXXXXX";
  std::string made = folder_.string();
  if (mkdtemp(made.data()) == nullptr) {
    trouble_ = "no folder " + made;
    return;
  }
  folder_ = made;
  trouble_ = write_files(vehicle_toml);
  if (!trouble_.empty()) return;
  Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(kDefaultLcmUrl);
  if (!opened) {
    trouble_ = opened.error().message;
    return;
  }
  bus_ = std::move(opened).value();
  timeline_ = std::make_unique<LiveTimeline>(bus_.get(), &stop_);
  for (const std::string& node : kNodes) {
    processes_.emplace_back(bus_.get(), channel_of(node, "PROCESS"),
                            [this, node](const process_t& m, Stamp arrival) {
                              Life& life = lives_[node];
                              if (life.pid != m.pid) life = {m.pid, arrival};
                            });
  }
  const std::string bin = variable("RCS_BIN_DIR");
  start_up();
  std::vector<std::string> scenario = {(folder_ / "course.toml").string()};
  scenario.insert(scenario.end(), sim_arguments.begin(), sim_arguments.end());
  sim_ = start("sim", bin + "/sim", scenario);
  next_ask_ = now() + kBeforeFirst;
}

VehicleRun::~VehicleRun() {
  (void)end();
  std::error_code error;  // a remaining folder is not a failure
  if (!keep_files_) std::filesystem::remove_all(folder_, error);
}

const std::filesystem::path& VehicleRun::keep_files() {
  keep_files_ = true;
  return folder_;
}

std::string VehicleRun::write_files(const std::string& vehicle_toml) {
  const std::string root = variable("RCS_SOURCE_DIR");
  std::string vehicle = text_of(root + "/config/demo3.toml");
  if (vehicle.empty()) return root + "/config/demo3.toml: cannot be read; is RCS_SOURCE_DIR set?";
  replace(&vehicle, "[up]\nnodes = [\"sp\", \"wm\", \"bg\"]",
          "[up]\nnodes = [\"sp\", \"wm\", \"bg\", \"gateway\"]");
  // A stop that a run leaves behind must not affect another run.
  vehicle += "\n[process]\nstate_directory = \"state\"\n";
  // Without a datum a restarted WM would begin another frame world at its current position.
  vehicle += "\n[world]\n";
  std::istringstream reference(text_of(root + "/config/sim/reference.toml"));
  for (std::string line; std::getline(reference, line);) {
    if (line.rfind("datum_", 0) == 0) vehicle += line + "\n";
  }
  std::ofstream(folder_ / "vehicle.toml") << vehicle << vehicle_toml;

  std::string course = fmt::format(
      "based_on = \"{}/config/sim/drive.toml\"\nduration_s = 90000\n[gps]\noutage = []\n"
      "[course]\nwaypoint = [\n  {{ x_m = 0, y_m = 0 }},\n",
      root);
  for (std::size_t k = 0; k + 1 < course_world().size(); ++k) {
    const Vec2& p = course_world()[k];
    course += fmt::format("  {{ x_m = {}, y_m = {} }},\n", p.x(), p.y());
  }
  std::ofstream(folder_ / "course.toml") << course << "]\n";
  return "";
}

void VehicleRun::start_up() {
  up_ = start("up", variable("RCS_BIN_DIR") + "/rcs", {"up", (folder_ / "vehicle.toml").string()});
}

std::unique_ptr<VehicleRun::Running> VehicleRun::start(const std::string& name,
                                                       const std::string& program,
                                                       const std::vector<std::string>& arguments) {
  Result<cli::ChildProcess> started = cli::ChildProcess::start(program, arguments);
  if (!started) {
    trouble_ = started.error().message;
    return nullptr;
  }
  return std::make_unique<Running>(Running{name, std::move(started).value(),
                                           std::ofstream(folder_ / (name + ".txt"), std::ios::app),
                                           ""});
}

bool VehicleRun::run_until(Stamp until, const std::function<bool()>& enough) {
  while (trouble_.empty()) {
    if (enough && enough()) return true;
    if (now() >= next_look_) {
      look_after();
      next_look_ = now() + kLook;
    }
    const Timeline::Step step = timeline_->advance(std::min(until, next_look_));
    if (step == Timeline::Step::kEnded) {
      trouble_ = bus_->status() ? "interrupted" : bus_->status().error().message;
    }
    if (step == Timeline::Step::kReached && now() >= until) return !enough && trouble_.empty();
  }
  return false;
}

void VehicleRun::look_after() {
  for (auto* const slot : {&up_, &sim_, &recorder_}) {
    if (*slot == nullptr) continue;
    const std::optional<cli::Exit> exit = read(slot->get());
    if (!exit) continue;
    if (slot != &sim_ || !sim_may_end_) {
      trouble_ = fmt::format("{} {}: {}", (*slot)->name, to_text(*exit), (*slot)->last_line);
    }
    slot->reset();
    if (!trouble_.empty()) return;
  }
  look_after_operator();
  look_after_client();
}

void VehicleRun::look_after_operator() {
  if (operator_) {
    const std::optional<cli::Exit> exit = read(operator_.get());
    if (!exit) return;
    if (!exit->by_signal && exit->code == 0) {
      next_waypoint_ = 0;
      next_ask_ = now();
    } else {
      gave_up_.push_back(operator_->last_line);
      next_ask_ = now() + kAskAgain;
    }
    operator_.reset();
  }
  if (now() < next_ask_) return;
  std::vector<std::string> words = {"go", "--speed", fmt::format("{}", kMaxSpeed_mps), "--radius",
                                    fmt::format("{}", kRadius_m)};
  if (next_waypoint_ == 0) ++courses_;
  for (std::size_t k = next_waypoint_; k < course_world().size(); ++k) {
    const Vec2& p = course_world()[k];
    words.emplace_back("--waypoint");
    words.push_back(fmt::format("{},{}", p.x(), p.y()));
  }
  operator_ = start("operator", variable("RCS_BIN_DIR") + "/rcs", words);
}

void VehicleRun::look_after_client() {
  if (client_ && read(client_.get())) client_.reset();
  if (client_ || !with_client_) return;
  client_ =
      start("client", variable("RCS_BIN_DIR") + "/dds_client", {"-v", "demo3", "watch", "90000"});
  ++clients_;
}

std::optional<cli::Exit> VehicleRun::read(Running* running) {
  const std::optional<cli::Exit> exit = running->process.collect();
  running->process.read_output([&](std::string_view line) {
    // The messages that the client receives, ten times a second, are ignored here.
    if (running != client_.get()) running->log << line << std::endl;
    running->last_line = line;
  });
  return exit;
}

int VehicleRun::pid_of(const std::string& node) const {
  const auto life = lives_.find(node);
  return life == lives_.end() ? 0 : life->second.pid;
}

Stamp VehicleRun::received_first(const std::string& node) const {
  const auto life = lives_.find(node);
  return life == lives_.end() ? Stamp::max() : life->second.first;
}

void VehicleRun::send_signal(const std::string& node, int signal) const {
  if (const int pid = pid_of(node); pid > 0) (void)kill(pid, signal);
}

void VehicleRun::send_signal_to_up(int signal) {
  if (up_) up_->process.send_signal(signal);
}

void VehicleRun::send_signal_to_sim(int signal) {
  sim_may_end_ = true;
  if (sim_) sim_->process.send_signal(signal);
}

void VehicleRun::restart_up() {
  if (!up_) return;
  up_->process.send_signal(SIGKILL);
  const Stamp until = now() + kStopWithin;
  while (!read(up_.get()) && now() < until) (void)timeline_->advance(now() + kLook);
  start_up();
}

int VehicleRun::run_program(const std::string& program, const std::vector<std::string>& arguments,
                            Duration most) {
  program_ = start(program, variable("RCS_BIN_DIR") + "/" + program, arguments);
  std::optional<cli::Exit> exit;
  const auto ended = [&] {
    if (program_ && !exit) exit = read(program_.get());
    return !program_ || exit.has_value();
  };
  const Stamp until = now() + most;
  while (trouble_.empty() && !ended() && now() < until) (void)run_until(now() + kLook, {});
  program_.reset();
  return exit && !exit->by_signal ? exit->code : -1;
}

void VehicleRun::record() {
  recorder_ = start("recorder", variable("RCS_BIN_DIR") + "/rcs",
                    {"record", (folder_ / "recording").string()});
}

void VehicleRun::use_loopback() {
  const std::string profile = "file://" + variable("RCS_SOURCE_DIR") + "/config/dds/loopback.xml";
  (void)setenv("CYCLONEDDS_URI", profile.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

void VehicleRun::keep_client() {
  use_loopback();
  with_client_ = true;
}

void VehicleRun::kill_client() {
  if (client_) client_->process.send_signal(SIGKILL);
}

std::string VehicleRun::end() {
  with_client_ = false;
  std::string summary;
  const Stamp until = timeline_ ? now() + kStopWithin : Stamp::min();
  for (const auto* slot : {&operator_, &client_, &sim_, &up_, &recorder_}) {
    Running* const running = slot->get();
    if (running == nullptr) continue;
    running->process.send_signal(SIGTERM);
    while (!read(running)) {
      if (now() >= until) running->process.send_signal(SIGKILL);
      // Not by the timeline: its receivers may no longer exist.
      std::array<pollfd, 2> polled = {
          {{running->process.exit_fd(), POLLIN, 0}, {running->process.output_fd(), POLLIN, 0}}};
      (void)poll(polled.data(), polled.size(), static_cast<int>(milliseconds(kLook)));
    }
    if (slot == &sim_) summary = running->last_line;
  }
  operator_.reset();
  client_.reset();
  sim_.reset();
  up_.reset();
  recorder_.reset();
  return summary;
}

}  // namespace rcs::live_faults
