// 10,000 messages a second on each channel in turn, copies of its own messages and garbage, while
// the vehicle drives: it drives on or stops as the state table says, its cycles are kept, memory is
// bounded, and everything that is not used is counted. RCS_FLOOD_S: seconds a channel, default 30.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "tests/live_faults/live_fault.h"
#include "tools/report/table.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);

constexpr const char* kFlooded[] = {
    channel::kIns,         channel::kGpsFix,         channel::kOdometry,
    channel::kLadarRanges, channel::kSpRegistration, channel::kSpPoints,
    channel::kWmNavState,  channel::kWmIntegrity,    channel::kWmMapPatch,
    channel::kBgCommand,   channel::kBgStop,         channel::kBgStatus,
    channel::kBgDrive,     channel::kUpProcess};

struct Row {
  std::string channel;
  int drives = 0;
  double longest_gap_ms = 0.0;  ///< between drive commands
  double memory_mb = 0.0;       ///< largest growth of a node
  double driven_m = 0.0;
  std::set<std::string> states;  ///< of BG
  std::set<std::string> events;
  bool well_after = false;
};

/// Notes what a vehicle does; the bus holds the addresses of its members until the end.
class Notes {
 public:
  explicit Notes(Bus* bus)
      : drives_(bus, channel::kBgDrive, [this](const drive_t&, Stamp at) { take(at); }),
        statuses_(bus, channel::kBgStatus,
                  [this](const status_t& m, Stamp) {
                    if (row_ != nullptr) row_->states.insert(m.state);
                  }),
        sp_(bus, channel::kSpEvent, [this](const event_t& m, Stamp) { take(m); }),
        wm_(bus, channel::kWmEvent, [this](const event_t& m, Stamp) { take(m); }),
        bg_(bus, channel::kBgEvent, [this](const event_t& m, Stamp) { take(m); }) {}

  /// @param row  null: nothing is noted
  void write_to(Row* row) {
    row_ = row;
    last_ = Stamp::min();
  }

 private:
  void take(Stamp at) {
    // Copies of drive commands cannot be told from those of BG.
    if (row_ == nullptr || row_->channel == channel::kBgDrive) return;
    ++row_->drives;
    if (last_ != Stamp::min()) {
      row_->longest_gap_ms = std::max(row_->longest_gap_ms, milliseconds(at - last_));
    }
    last_ = at;
  }
  void take(const event_t& m) {
    if (row_ != nullptr) row_->events.insert(m.code);
  }

  Row* row_ = nullptr;
  Stamp last_ = Stamp::min();
  Tap<drive_t> drives_;
  Tap<status_t> statuses_;
  Tap<event_t> sp_, wm_, bg_;
};

Row flood(LiveFault* live, Notes* notes, const char* flooded, int seconds_each) {
  Row row;
  row.channel = flooded;
  std::map<std::string, double> before_mb;
  for (const std::string& node : kNodes) before_mb[node] = resident_mb(live->run.pid_of(node));
  live->safety.reset();
  notes->write_to(&row);
  const int status =
      live->run.run_program("flood_bus", {flooded, "10000", std::to_string(seconds_each)},
                            from_seconds(3.0 * seconds_each + 30.0));
  notes->write_to(nullptr);
  EXPECT_EQ(status, 0) << flooded;
  for (const std::string& node : kNodes) {
    row.memory_mb = std::max(row.memory_mb, resident_mb(live->run.pid_of(node)) - before_mb[node]);
  }
  row.driven_m = live->safety.metrics().driven_m;
  live->recovery.reset();
  row.well_after = live->run_until_well(kPatience);
  return row;
}

template <class T>
std::string joined(const T& texts) {
  std::string all;
  for (const std::string& t : texts) all += (all.empty() ? "" : " ") + t;
  return all;
}

TEST(Flood, OfEachChannel) {
  LiveFault live;
  ASSERT_EQ(live.run.trouble(), "");
  Notes notes(live.run.bus());
  ASSERT_TRUE(live.run_until_well(kPatience));
  const int seconds_each = number_from("RCS_FLOOD_S", 30);
  report::Table table;
  table.header = {"channel", "drives", "gap ms", "memory MB", "driven m", "states, events"};
  for (const char* flooded : kFlooded) {
    const Row row = flood(&live, &notes, flooded, seconds_each);
    table.rows.push_back({row.channel, std::to_string(row.drives),
                          fmt::format("{:.0f}", row.longest_gap_ms),
                          fmt::format("{:.1f}", row.memory_mb), fmt::format("{:.0f}", row.driven_m),
                          joined(row.states) + "; " + joined(row.events)});
    EXPECT_TRUE(row.well_after) << flooded << ": " << live.recovery.missing();
    EXPECT_LT(row.memory_mb, kFloodMemory_mb) << flooded;
    if (row.channel != channel::kBgDrive) {
      EXPECT_GT(row.drives, kFloodCycles * 20.0 * seconds_each) << flooded;
    }
    EXPECT_EQ(live.safety.metrics().collisions, 0) << flooded;
  }
  fmt::print("{}", report::to_text(table));
  EXPECT_EQ(live.run.trouble(), "");
}

}  // namespace
}  // namespace rcs::live_faults
