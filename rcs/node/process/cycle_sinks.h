#pragma once
// Destinations of the executor's accounts: the bus (live) or a file next to a replay's log.

#include <cstdio>
#include <deque>
#include <memory>
#include <string>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "rcs/base/result.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/executor.h"

namespace rcs {

/// Publishes cycle_t on <NAME>_CYCLE. No allocation after a node's first account.
class CyclePublisher final : public CycleSink {
 public:
  explicit CyclePublisher(Bus* bus) : bus_(bus) {}
  void on_account(const NodeInfo& node, const CycleAccount& account) override;

 private:
  struct Publication {
    Outbox<cycle_t> outbox;
    cycle_t message{};
  };
  Publication& publication(const NodeInfo& node);

  Bus* bus_;
  std::deque<Publication> publications_;
};

/// One line of CSV for each account: node,index,utime,late_us,slack_us,wall_us,cpu_us,stages,
/// stages as "name:us name:us". Stopwatch values differ from run to run; they never enter the log
/// itself.
class TimingFile final : public CycleSink {
 public:
  static Result<std::unique_ptr<TimingFile>> create(const std::string& path);
  void on_account(const NodeInfo& node, const CycleAccount& account) override;
  /// Returns an error if the file is incomplete.
  Outcome close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { (void)std::fclose(file); }
  };
  TimingFile(std::FILE* file, std::string path) : path_(std::move(path)), file_(file) {}

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace rcs
