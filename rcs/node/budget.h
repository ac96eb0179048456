#pragma once
// Work units, grants and the stopwatch. Algorithms receive a grant of work units and never read a
// clock; nodes mark the stages of a cycle for its account.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "rcs/base/stamp.h"
#include "rcs/base/work_units.h"
#include "rcs/node/node.h"

namespace rcs {

struct GrantParams {
  WorkUnits cap = 1'000'000;       ///< upper limit, > 0
  double nominal_unit_ns = 100.0;  ///< cost of a unit on the vehicle's computer, > 0
  double reserve = 0.3;            ///< share of the slack kept in reserve, [0, 1)
};

/// grant = min(cap, (1 - reserve) * (deadline - now) / nominal cost), at least 0.
[[nodiscard]] WorkUnits grant(const Cycle& cycle, const GrantParams& params);

/// CPU time of the process, over all its threads.
[[nodiscard]] Duration process_cpu();

/// Accumulates wall time by stage, and the thread's CPU time. It reads CLOCK_MONOTONIC and
/// CLOCK_THREAD_CPUTIME_ID in budget.cpp alone. A unit of work may extend over several cycles (SP
/// converts facets as they arrive): close_account() closes its account, which the executor then
/// reports.
class StageClock {
 public:
  static constexpr std::size_t kMaxStages = 12;
  struct Stage {
    std::string_view name;  ///< a literal
    Duration wall{};
  };

  /// Begins a cycle, with a new account if the last one is closed.
  void start_cycle();
  /// Adds the time since the last mark (or the start) to stage `name`. At most kMaxStages names.
  void mark(std::string_view name);
  void end_cycle();
  /// The unit of work is complete with this cycle: reports it. Periodic nodes call it every cycle.
  void close_account() { closed_ = true; }

  [[nodiscard]] bool closed() const { return closed_; }
  [[nodiscard]] std::size_t stages() const { return count_; }
  [[nodiscard]] const Stage& stage(std::size_t i) const { return stages_[i]; }
  [[nodiscard]] Duration used_wall() const { return used_wall_; }    ///< of the account so far
  [[nodiscard]] Duration used_cpu() const { return used_cpu_; }      ///< of the account so far
  [[nodiscard]] Duration cycle_wall() const { return cycle_wall_; }  ///< of the last cycle

 private:
  std::array<Stage, kMaxStages> stages_{};
  std::size_t count_ = 0;
  bool closed_ = false;
  // Times are whole microseconds, rounded down: their differences add up without a bias.
  Duration wall_start_{};
  Duration cpu_start_{};
  Duration last_mark_{};
  Duration cycle_wall_{};
  Duration used_wall_{};
  Duration used_cpu_{};
};

}  // namespace rcs
