#pragma once
// Status of a node's process: process_t on <NAME>_PROCESS, once a second, published from the node's
// own thread, so that a node that hangs is silent.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/executor.h"
#include "rcs/node/params/params.h"
#include "rcs/node/process/realtime.h"

namespace rcs {

/// Tables [process] and [up] of the vehicle's configuration: how its processes run.
struct ProcessTables {
  bool bus_firewalled = false;  ///< the bus's port is dropped on every interface but lo
  std::string state_directory;  ///< see open_stop_latch(); empty: the default
  std::map<std::string, RealtimeParams> realtime;  ///< [process.NAME]; missing: no request
  std::vector<std::string> nodes = {"sp", "wm"};   ///< that `rcs up` starts, in this order
  /// Of these, the nodes without which the vehicle starts, too.
  std::vector<std::string> non_critical = {"gateway", "ros2_bridge"};

  [[nodiscard]] bool is_critical(const std::string& node) const;

  [[nodiscard]] RealtimeParams realtime_of(const std::string& node) const;
};
[[nodiscard]] Result<ProcessTables> read_process_tables(const ParamFile& file);

/// Forwards accounts, and keeps the counts of the newest for process_t.
class CycleCounter final : public CycleSink {
 public:
  struct Counts {
    std::int64_t cycles = 0;
    std::int64_t missed = 0;
    std::int64_t overruns = 0;
    std::int8_t degrade_level = 0;
  };
  explicit CycleCounter(CycleSink* next) : next_(next) {}
  void on_account(const NodeInfo& node, const CycleAccount& account) override;
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  CycleSink* next_;
  Counts counts_;
};

/// Resource usage of this process as reported by the kernel. No allocation after construction.
class ProcessUsage {
 public:
  ProcessUsage();
  /// Fills cpu_us, rss_kb, heap_kb and descriptors.
  void read(process_t* out);

 private:
  FileHandle statm_;
  FileHandle descriptors_;
};

/// Facts that do not change while the process runs.
struct ProcessFacts {
  std::string node;  ///< whose process it is
  std::string config;
  std::int64_t config_hash = 0;  ///< ParamFile::text_id()
  Stamp start;
  RealtimeGrant grant;
  std::string reach_note;  ///< of the bus; see bus_exposure.h
};

/// Runs next to a process's node, every second.
class ProcessNode final : public Node {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  /// @param of  whose process it is
  ProcessNode(Bus* bus, const ProcessFacts& facts, const CycleCounter* cycles, const Node* of);

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }
  void run(const Cycle& cycle) override;

 private:
  NodeInfo info_;
  PeriodicClock clock_{kPeriod};
  const CycleCounter* cycles_;
  const Node* of_;
  std::string note_;  // of the start
  ProcessUsage usage_;
  Outbox<process_t> outbox_;
  process_t message_{};
};

}  // namespace rcs
