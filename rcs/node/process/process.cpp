#include "rcs/node/process/process.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "rcs/node/report.h"

namespace rcs {
namespace {

std::int64_t microseconds(const timeval& t) {
  return std::int64_t{t.tv_sec} * 1'000'000 + t.tv_usec;
}

/// The second number of /proc/self/statm: pages in memory.
std::int64_t resident_pages(int statm) {
  std::array<char, 128> text{};
  const ssize_t n = pread(statm, text.data(), text.size(), 0);
  const char* const end = text.data() + std::max<ssize_t>(n, 0);
  const char* const space = std::find(static_cast<const char*>(text.data()), end, ' ');
  std::int64_t pages = 0;
  if (space != end) std::from_chars(space + 1, end, pages);
  return pages;
}

/// Entries of /proc/self/fd. Not by opendir(), which allocates.
std::int32_t count_descriptors(int directory) {
  std::int32_t count = 0;
  if (lseek(directory, 0, SEEK_SET) != 0) return count;
  alignas(dirent64) std::array<char, 4096> entries{};
  for (;;) {
    const ssize_t n = getdents64(directory, entries.data(), entries.size());
    if (n <= 0) return count;
    for (ssize_t at = 0; at < n;) {
      const auto* entry = reinterpret_cast<const dirent64*>(entries.data() + at);
      if (entry->d_name[0] != '.') ++count;
      at += entry->d_reclen;
    }
  }
}

bool is_node_name(std::string_view name) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(),
                     [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; });
}

void read_realtime(ParamTable table, RealtimeParams* p) {
  table.get("realtime_priority", &p->realtime_priority, {0, 98},
            "SCHED_FIFO priority of the node; LCM's receiver thread gets one more. 0: ordinary "
            "scheduling.");
  table.get("lock_memory", &p->lock_memory,
            "Locks the memory of the process, so that no page of it is fetched from a disk again.");
  table.get("cpus", &p->cpus, {0, 1023}, "Processors on which the process may run. Empty: any.");
}

void read_up(ParamTable up, std::vector<std::string>* nodes,
             std::vector<std::string>* non_critical) {
  const std::vector<std::string> by_default = *non_critical;
  up.get("nodes", nodes,
         "Nodes that `rcs up` starts, in this order. Names consist of a-z, 0-9 and '_'.");
  if (nodes->empty()) up.fail("nodes", "empty: nothing to run");
  for (auto name = nodes->begin(); name != nodes->end(); ++name) {
    // The name becomes part of channel names and of a program's path.
    if (!is_node_name(*name)) {
      up.fail("nodes", fmt::format("{} is not a valid node name: a-z, then a-z, 0-9 and _", *name));
    }
    if (std::find(nodes->begin(), name, *name) != name) {
      up.fail("nodes", fmt::format("{} is listed twice", *name));
    }
  }
  up.get("non_critical", non_critical,
         "Nodes without which the vehicle starts, too: if one rejects this file it is reported and "
         "the others run.");
  for (const std::string& name : *non_critical) {
    // Not all of the default list have to run.
    const auto in = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    if (!in(*nodes) && !in(by_default)) {
      up.fail("non_critical", fmt::format("{} is not in nodes", name));
    }
  }
}

void append(std::string* note, std::string_view text) {
  if (text.empty()) return;
  if (!note->empty()) note->append("; ");
  note->append(text);
}

}  // namespace

RealtimeParams ProcessTables::realtime_of(const std::string& node) const {
  const auto found = realtime.find(node);
  return found == realtime.end() ? RealtimeParams{} : found->second;
}

bool ProcessTables::is_critical(const std::string& node) const {
  return std::find(non_critical.begin(), non_critical.end(), node) == non_critical.end();
}

Result<ProcessTables> read_process_tables(const ParamFile& file) {
  ProcessTables tables;
  ParamTable root = file.root();
  ParamTable process = root.table("process");
  process.get("bus_firewalled", &tables.bus_firewalled,
              "States that the port of the bus is dropped on every interface but lo, so that nodes "
              "do not report it as reachable.");
  process.get("state_directory", &tables.state_directory,
              "Folder in which emergency stops are latched, relative to this file. Empty: "
              "$STATE_DIRECTORY or a default.");
  for (const std::string& name : process.keys()) {
    if (name == "bus_firewalled" || name == "state_directory") continue;
    read_realtime(process.table(name), &tables.realtime[name]);
  }
  read_up(root.table("up"), &tables.nodes, &tables.non_critical);

  // The node itself checks the rest of the file.
  std::vector<std::string> others = root.keys();
  others.erase(
      std::remove_if(others.begin(), others.end(),
                     [](const std::string& key) { return key == "process" || key == "up"; }),
      others.end());
  if (Outcome read_all = file.finish(others); !read_all) return read_all.error();
  return tables;
}

void CycleCounter::on_account(const NodeInfo& node, const CycleAccount& account) {
  counts_.cycles = static_cast<std::int64_t>(account.cycle->index) + 1;
  counts_.missed = account.missed;
  counts_.overruns = account.overruns;
  counts_.degrade_level = static_cast<std::int8_t>(account.degrade_level);
  if (next_ != nullptr) next_->on_account(node, account);
}

ProcessUsage::ProcessUsage()
    : statm_(open("/proc/self/statm", O_RDONLY | O_CLOEXEC)),
      descriptors_(open("/proc/self/fd", O_RDONLY | O_CLOEXEC | O_DIRECTORY)) {}

void ProcessUsage::read(process_t* out) {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) {
    out->cpu_us = microseconds(usage.ru_utime) + microseconds(usage.ru_stime);
  }
  out->rss_kb = resident_pages(statm_.get()) * sysconf(_SC_PAGESIZE) / 1024;
  // hblkhd: the blocks too large for an arena, which have mappings of their own.
  const struct mallinfo2 heap = mallinfo2();
  out->heap_kb = static_cast<std::int64_t>((heap.uordblks + heap.hblkhd) / 1024);
  out->descriptors = count_descriptors(descriptors_.get());
}

ProcessNode::ProcessNode(Bus* bus, const ProcessFacts& facts, const CycleCounter* cycles,
                         const Node* of)
    : info_{facts.node + "_process", kPeriod, Duration::zero()},
      cycles_(cycles),
      of_(of),
      outbox_(bus, channel_of(facts.node, "PROCESS")) {
  message_.node = facts.node;
  message_.pid = getpid();
  message_.start_utime = to_utime(facts.start);
  message_.config = facts.config;
  message_.config_hash = facts.config_hash;
  message_.realtime_priority = static_cast<std::int8_t>(facts.grant.realtime_priority);
  message_.memory_locked = facts.grant.memory_locked ? 1 : 0;
  for (const std::string& refusal : facts.grant.refusals) append(&note_, refusal);
  append(&note_, facts.reach_note);
}

void ProcessNode::run(const Cycle& cycle) {
  clock_.advance(cycle.now);
  const CycleCounter::Counts& counts = cycles_->counts();
  message_.utime = to_utime(cycle.now);
  message_.cycles = counts.cycles;
  message_.missed = counts.missed;
  message_.overruns = counts.overruns;
  message_.degrade_level = counts.degrade_level;
  message_.note = note_;
  append(&message_.note, of_->note());
  usage_.read(&message_);
  outbox_.publish(&message_);
}

}  // namespace rcs
