#include "tools/rcs/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>

#include "rcs/node/timeline/live_timeline.h"
#include "tools/rcs/standard_streams.h"

namespace rcs::cli {
namespace {

// The only object that a signal handler may access.
volatile std::sig_atomic_t interrupted = 0;

extern "C" void on_interrupt(int /*signal*/) { interrupted = 1; }

// The signal handlers before the guard; only one guard exists at a time.
void (*before_interrupt)(int) = SIG_DFL;
void (*before_terminate)(int) = SIG_DFL;

constexpr int kBarCells = 40;
constexpr std::int64_t kLinePeriod_us = 10'000'000;

}  // namespace

Progress::Progress(std::string_view label, std::int64_t total)
    : label_(label),
      total_(std::max<std::int64_t>(total, 1)),
      on_terminal_(::isatty(STDERR_FILENO) == 1),
      line_utime_(wall_utime()) {
  at(0);
}

Progress::~Progress() {
  if (on_terminal_) replace_line("");
}

void Progress::at(std::int64_t done) {
  const int percent = static_cast<int>(100 * std::clamp<std::int64_t>(done, 0, total_) / total_);
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  if (on_terminal_) {
    const int full = kBarCells * percent / 100;
    replace_line(
        fmt::format("{} [{:=<{}}{:<{}}] {:3d} %", label_, "", full, "", kBarCells - full, percent));
  } else if (const std::int64_t now = wall_utime(); now - line_utime_ >= kLinePeriod_us) {
    line_utime_ = now;
    fmt::print(stderr, "rcs {}: {} %\n", label_, percent);
  }
}

InterruptGuard::InterruptGuard() {
  interrupted = 0;
  before_interrupt = std::signal(SIGINT, on_interrupt);
  before_terminate = std::signal(SIGTERM, on_interrupt);
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, before_interrupt);
  std::signal(SIGTERM, before_terminate);
}

// NOLINTNEXTLINE(readability-convert-member-functions-to-static): valid while the guard lives
bool InterruptGuard::requested() const { return interrupted != 0; }

bool was_interrupted() { return interrupted != 0; }

void note_interrupt() { interrupted = 1; }

}  // namespace rcs::cli
