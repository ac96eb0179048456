// rcs top

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/time_text.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/evaluation/top_model.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"
#include "tools/rcs/vehicle/top_screen.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kTopName = "top";
constexpr Duration kRedraw = from_milliseconds(500.0);
constexpr int kMaxBurst = 1000;

/// A channel of the model; malformed messages are counted.
template <class T>
Tap<T> tap(Bus* bus, std::string_view channel, evaluation::TopModel* model,
           void (evaluation::TopModel::*take)(const T&, Stamp)) {
  return Tap<T>(
      bus, channel, [model, take](const T& m, Stamp arrival) { (model->*take)(m, arrival); },
      [model, name = std::string(channel)] { model->on_malformed(name); });
}

/// Subscribes to the channels of the nodes. LCM accepts regular expressions: any node.
struct Taps {
  Taps(Bus* bus, evaluation::TopModel* model)
      : process(tap(bus, "*_PROCESS", model, &evaluation::TopModel::on_process)),
        cycle(tap(bus, "*_CYCLE", model, &evaluation::TopModel::on_cycle)),
        event(tap(bus, "*_EVENT", model, &evaluation::TopModel::on_event)),
        nav(tap(bus, channel::kWmNavState, model, &evaluation::TopModel::on_nav)),
        integrity(tap(bus, channel::kWmIntegrity, model, &evaluation::TopModel::on_integrity)),
        fix(tap(bus, channel::kGpsFix, model, &evaluation::TopModel::on_fix)),
        status(tap(bus, channel::kBgStatus, model, &evaluation::TopModel::on_status)),
        mission(tap(bus, channel::kMissionStatus, model, &evaluation::TopModel::on_mission)),
        routes(tap(bus, channel::kMissionRoutes, model, &evaluation::TopModel::on_routes)) {}

  Tap<process_t> process;
  Tap<cycle_t> cycle;
  Tap<event_t> event;
  Tap<nav_state_t> nav;
  Tap<integrity_t> integrity;
  Tap<gps_fix_t> fix;
  Tap<status_t> status;
  Tap<status_t> mission;
  Tap<routes_t> routes;
};

/// The terminal as a screen without echo; restored at the end.
class Screen {
 public:
  Screen() {
    (void)tcgetattr(STDIN_FILENO, &before_);
    termios raw = before_;
    // Ctrl-C and Ctrl-Z are read as characters: a stopped program would not restore the terminal.
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | ISIG);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    (void)tcsetattr(STDIN_FILENO, TCSANOW, &raw);
    put("\033[?1049h\033[?25l\033[?7l\033[2J");  // other screen, no cursor, no wrapping
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen() {
    put("\033[?7h\033[?25h\033[?1049l");
    (void)tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }

  void show(const std::vector<TopLine>& lines) const {
    winsize window{};
    ScreenSize size;
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0 && window.ws_row > 0) {
      size = {window.ws_col, window.ws_row};
    }
    put(screen_text(lines, size));
  }

  /// True if a key for the end was pressed or the input was closed.
  [[nodiscard]] bool asked_to_leave() const {
    std::array<char, 64> keys{};
    const ssize_t n = read(STDIN_FILENO, keys.data(), keys.size());
    constexpr char kCtrlC = 3;
    return n <= 0 || std::any_of(keys.begin(), keys.begin() + n, [](char key) {
             return key == 'q' || key == 'Q' || key == kCtrlC;
           });
  }

 private:
  static void put(std::string_view text) {
    while (!text.empty()) {
      const ssize_t n = write(STDOUT_FILENO, text.data(), text.size());
      if (n <= 0) return;
      text.remove_prefix(static_cast<std::size_t>(n));
    }
  }

  termios before_{};
};

class Top final : public Command {
 public:
  explicit Top(CLI::App* rcs)
      : Command(rcs->add_subcommand("top",
                                    "Show the nodes on the bus live: times, load, inputs, state")) {
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--once", once_,
                    "receive for the time --listen and print once; default without a terminal");
    app()->add_flag("--json", json_, "print the state as JSON; implies --once");
    app()
        ->add_option("--listen", listen_s_,
                     "receiving time [s] with --once or --json; rates are over at most 5 s")
        ->check(CLI::Range(0.1, 3600.0))
        ->capture_default_str();
    app()->footer(
        "q or Ctrl-C quits. Computing times and rates are of the last 5 s. Columns of a node:\n"
        "  up     time since its start; Hz: cycles (sp: scans) per second\n"
        "  p50, max, slack   median and maximum of the computing time, and the smallest time left\n"
        "         to the deadline [ms]; negative: an overrun\n"
        "  over, miss, lvl   overruns and missed periods since the start; degrade level\n"
        "  cpu, MB, rt   load [%], resident memory, priority of SCHED_FIFO (+l: memory locked)\n"
        "An input has the rate and the age of its newest message, and the numbers of dropped,\n"
        "missing (gap) and malformed (malf) messages and of those of a second publisher (rej) if\n"
        "there are any. The time of an event is UTC, followed by the seconds since the start of "
        "the\n"
        "first node. With --once the exit status is 1 if no node is alive.\n"
        "Examples:\n"
        "  rcs top\n"
        "  rcs top --json | jq '.nodes[] | {node, used_max_ms, overruns}'");
  }

  int run() override {
    const StopSignals stop;
    const Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(lcm_url_);
    if (!opened) return fail(kTopName, opened.error());
    LcmBus* const bus = opened->get();
    evaluation::TopModel model;
    const Taps taps(bus, &model);
    if (const Outcome status = bus->status(); !status) return fail(kTopName, status.error());
    LiveTimeline timeline(bus, &stop);
    const bool live = !once_ && !json_ && isatty(STDOUT_FILENO) == 1 && isatty(STDIN_FILENO) == 1;
    return live ? show_live(bus, stop, timeline, &model) : show_once(bus, &timeline, &model);
  }

 private:
  int show_once(const LcmBus* bus, LiveTimeline* timeline, evaluation::TopModel* model) const {
    const Stamp until = timeline->now() + from_seconds(listen_s_);
    Timeline::Step step = Timeline::Step::kDelivered;
    while (step == Timeline::Step::kDelivered) step = timeline->advance(until);
    if (const Outcome status = bus->status(); !status) return fail(kTopName, status.error());
    if (step == Timeline::Step::kEnded) {
      note_interrupt();
      return fail(kTopName, Error{"interrupted"});
    }
    const evaluation::TopView view = model->view(timeline->now(), wall_utime());
    fmt::print(
        "{}", json_ ? report::json_document(kTopName, to_json(view)) : plain_text(top_lines(view)));
    const bool any = std::any_of(view.nodes.begin(), view.nodes.end(),
                                 [](const evaluation::TopView::Node& n) { return n.alive; });
    return any ? kExitOk : kExitNegative;
  }

  static int show_live(LcmBus* bus, const StopSignals& stop, const LiveTimeline& timeline,
                       evaluation::TopModel* model) {
    const Screen screen;
    Stamp redraw = timeline.now();
    while (bus->status()) {
      for (int i = 0; i < kMaxBurst && bus->deliver_one(timeline.now()); ++i) {
      }
      const Stamp now = timeline.now();
      if (now >= redraw) {
        std::vector<TopLine> lines = top_lines(model->view(now, wall_utime()));
        lines.insert(lines.begin(), {fmt::format("rcs top  {} UTC  q quits  {}",
                                                 time_of_day(wall_utime()), bus->url())});
        screen.show(lines);
        redraw = now + kRedraw;
      }
      std::array<pollfd, 3> polled = {
          {{bus->fd(), POLLIN, 0}, {stop.fd(), POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}}};
      (void)poll(polled.data(), polled.size(), static_cast<int>(milliseconds(redraw - now)) + 1);
      if (polled[1].revents != 0) return kExitOk;
      if (polled[2].revents != 0 && screen.asked_to_leave()) return kExitOk;
    }
    return fail(kTopName, bus->status().error());
  }

  std::string lcm_url_;
  bool once_ = false;
  bool json_ = false;
  double listen_s_ = 3.0;
};

}  // namespace

void add_top_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Top>(rcs));
}

}  // namespace rcs::cli
