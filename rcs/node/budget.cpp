#include "rcs/node/budget.h"

#include <time.h>

#include <algorithm>

#include "rcs/base/check.h"

namespace rcs {
namespace {

Duration read_clock(clockid_t id) {
  timespec t{};
  RCS_CHECK(clock_gettime(id, &t) == 0);
  return Duration(std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000);
}

}  // namespace

WorkUnits grant(const Cycle& cycle, const GrantParams& params) {
  RCS_CHECK(params.cap > 0 && params.nominal_unit_ns > 0.0);
  const double slack_ns = static_cast<double>((cycle.deadline - cycle.now).count()) * 1e3;
  const double units = (1.0 - params.reserve) * slack_ns / params.nominal_unit_ns;
  // Compared as double: a cast of a value beyond int64 would be undefined.
  if (units >= static_cast<double>(params.cap)) return params.cap;
  return units <= 0.0 ? 0 : static_cast<WorkUnits>(units);
}

Duration process_cpu() { return read_clock(CLOCK_PROCESS_CPUTIME_ID); }

void StageClock::start_cycle() {
  if (closed_) {
    count_ = 0;
    closed_ = false;
    used_wall_ = used_cpu_ = Duration::zero();
  }
  cpu_start_ = read_clock(CLOCK_THREAD_CPUTIME_ID);
  wall_start_ = last_mark_ = read_clock(CLOCK_MONOTONIC);
}

void StageClock::mark(std::string_view name) {
  const Duration now = read_clock(CLOCK_MONOTONIC);
  Stage* const end = stages_.data() + count_;
  Stage* stage = std::find_if(stages_.data(), end, [&](const Stage& s) { return s.name == name; });
  if (stage == end) {
    RCS_CHECK(count_ < kMaxStages);
    ++count_;
    *stage = {name, Duration::zero()};
  }
  stage->wall += now - last_mark_;
  last_mark_ = now;
}

void StageClock::end_cycle() {
  cycle_wall_ = read_clock(CLOCK_MONOTONIC) - wall_start_;
  used_wall_ += cycle_wall_;
  used_cpu_ += read_clock(CLOCK_THREAD_CPUTIME_ID) - cpu_start_;
}

}  // namespace rcs
