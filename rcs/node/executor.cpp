#include "rcs/node/executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace rcs {
namespace {

/// A node with its account.
struct Slot {
  explicit Slot(Node* n) : node(n), inputs(n->inboxes()) { report.name = n->info().name; }

  /// Start of its next cycle: a node is one process, busy until its output is published.
  [[nodiscard]] Stamp obligation() const { return std::max(node->next_wakeup(), busy_until); }

  Node* node;
  std::vector<const InboxBase*> inputs;
  StageClock stages;
  Stamp busy_until = Stamp::min();
  NodeReport report;
};

void run_cycle(Slot* slot, Timeline* timeline, CycleSink* sink) {
  const NodeInfo& info = slot->node->info();
  NodeReport& report = slot->report;

  Cycle cycle;
  cycle.index = static_cast<std::uint64_t>(report.cycles++);
  cycle.now = timeline->now();
  // Stamp::min() means "at once", not an obligation since then.
  const Stamp wakeup = slot->node->next_wakeup();
  cycle.wakeup = wakeup == Stamp::min() ? cycle.now : wakeup;
  cycle.deadline = cycle.wakeup + info.budget;
  cycle.stages = &slot->stages;

  timeline->begin_cycle(slot->node->nominal_compute());
  slot->stages.start_cycle();
  slot->node->run(cycle);
  slot->stages.end_cycle();
  const Stamp end = timeline->end_cycle();

  slot->busy_until = end;
  report.missed = slot->node->missed_cycles();
  if (end > cycle.deadline) ++report.overruns;
  const Duration late = cycle.now - cycle.wakeup;
  report.worst_late = std::max(report.worst_late, late);
  report.worst_wall = std::max(report.worst_wall, slot->stages.cycle_wall());
  if (slot->stages.closed() && sink != nullptr) {
    sink->on_account(info, {&cycle, late, cycle.deadline - end, report.missed, report.overruns,
                            &slot->inputs, slot->node->degrade_level()});
  }
}

}  // namespace

RunReport run(const std::vector<Node*>& nodes, Timeline& timeline, CycleSink* sink) {
  RCS_CHECK(!nodes.empty());
  std::vector<Slot> slots(nodes.begin(), nodes.end());

  for (;;) {
    Slot& first = *std::min_element(slots.begin(), slots.end(), [](const Slot& a, const Slot& b) {
      return a.obligation() < b.obligation();
    });
    const Timeline::Step step = timeline.advance(first.obligation());
    if (step == Timeline::Step::kEnded) break;
    // The message may have made another node due: choose again after each.
    if (step == Timeline::Step::kReached) run_cycle(&first, &timeline, sink);
  }

  RunReport report;
  for (Slot& slot : slots) {
    for (const InboxBase* inbox : slot.inputs) {
      slot.report.inputs.push_back({std::string(inbox->channel()), inbox->account()});
    }
    report.nodes.push_back(std::move(slot.report));
  }
  return report;
}

std::string RunReport::text() const {
  std::string out;
  const auto line = std::back_inserter(out);
  for (const NodeReport& n : nodes) {
    fmt::format_to(line,
                   "{}: {} cycles, {} missed, {} overruns, late at most {:.3f} ms, "
                   "cycle at most {:.3f} ms\n",
                   n.name, n.cycles, n.missed, n.overruns, milliseconds(n.worst_late),
                   milliseconds(n.worst_wall));
    if (n.cycles == 0) continue;  // messages that overwrite each other in its inboxes are no loss
    if (!n.inputs.empty()) {
      fmt::format_to(line, "  {:<20} {:>8} {:>8} {:>7} {:>8} {:>9} {:>8}\n", "input", "received",
                     "dropped", "gaps", "repeated", "malformed", "rejected");
    }
    for (const NodeReport::Input& i : n.inputs) {
      fmt::format_to(line, "  {:<20} {:>8} {:>8} {:>7} {:>8} {:>9} {:>8}\n", i.channel,
                     i.account.received, i.account.dropped, i.account.gaps, i.account.repeated,
                     i.account.malformed, i.account.rejected);
    }
  }
  return out;
}

}  // namespace rcs
