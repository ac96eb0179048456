#include "rcs/node/process/cycle_sinks.h"

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstring>

#include "rcs/node/report.h"

namespace rcs {

CyclePublisher::Publication& CyclePublisher::publication(const NodeInfo& node) {
  const auto known =
      std::find_if(publications_.begin(), publications_.end(),
                   [&](const Publication& p) { return p.message.node == node.name; });
  if (known != publications_.end()) return *known;
  Publication& p =
      publications_.emplace_back(Publication{{bus_, channel_of(node.name, "CYCLE")}, {}});
  p.message.node = node.name;
  p.message.stage.resize(StageClock::kMaxStages);  // n_stages of them are sent
  return p;
}

void CyclePublisher::on_account(const NodeInfo& node, const CycleAccount& account) {
  Publication& p = publication(node);
  const Cycle& cycle = *account.cycle;
  const StageClock& stages = *cycle.stages;
  cycle_t& m = p.message;
  m.utime = to_utime(cycle.now);
  m.index = static_cast<std::int64_t>(cycle.index);
  m.wakeup_utime = to_utime(cycle.wakeup);
  m.deadline_utime = to_utime(cycle.deadline);
  m.late_us = account.late.count();
  m.used_wall_us = stages.used_wall().count();
  m.used_cpu_us = stages.used_cpu().count();
  m.slack_us = account.slack.count();
  m.missed = account.missed;
  m.overruns = account.overruns;
  m.degrade_level = static_cast<std::int8_t>(account.degrade_level);
  m.n_stages = static_cast<std::int32_t>(stages.stages());
  for (std::size_t i = 0; i < stages.stages(); ++i) {
    m.stage[i].name = stages.stage(i).name;
    m.stage[i].wall_us = stages.stage(i).wall.count();
  }
  m.n_inputs = static_cast<std::int32_t>(account.inputs->size());
  m.input.resize(account.inputs->size());
  for (std::size_t i = 0; i < account.inputs->size(); ++i) {
    const InboxBase& inbox = *(*account.inputs)[i];
    const InboxBase::Account& a = inbox.account();
    input_account_t& out = m.input[i];
    out.channel = inbox.channel();
    out.received = a.received;
    out.dropped = a.dropped;
    out.gaps = a.gaps;
    out.malformed = a.malformed;
    out.rejected = a.rejected;
    out.age_us = a.age(cycle.now).count();
  }
  p.outbox.publish(&m);
}

Result<std::unique_ptr<TimingFile>> TimingFile::create(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "we");
  if (file == nullptr) return Error{path + ": cannot create: " + std::strerror(errno)};
  std::fputs("node,index,utime,late_us,slack_us,wall_us,cpu_us,stages\n", file);
  return std::unique_ptr<TimingFile>(new TimingFile(file, path));
}

void TimingFile::on_account(const NodeInfo& node, const CycleAccount& account) {
  const Cycle& cycle = *account.cycle;
  const StageClock& stages = *cycle.stages;
  std::FILE* const f = file_.get();
  std::fprintf(f, "%s,%" PRIu64 ",%" PRId64 ",%" PRId64 ",%" PRId64 ",%" PRId64 ",%" PRId64 ",",
               node.name.c_str(), cycle.index, to_utime(cycle.now), account.late.count(),
               account.slack.count(), stages.used_wall().count(), stages.used_cpu().count());
  for (std::size_t i = 0; i < stages.stages(); ++i) {
    const StageClock::Stage& s = stages.stage(i);
    std::fprintf(f, "%s%.*s:%" PRId64, i == 0 ? "" : " ", static_cast<int>(s.name.size()),
                 s.name.data(), s.wall.count());
  }
  std::fputc('\n', f);
}

Outcome TimingFile::close() {
  std::FILE* const file = file_.release();
  if (file == nullptr) return Done{};
  const bool failed = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || failed) {
    return Error{path_ + ": cannot write: " + std::strerror(errno)};
  }
  return Done{};
}

}  // namespace rcs
