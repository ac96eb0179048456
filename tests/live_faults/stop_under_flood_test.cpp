// 10,000 distinct valid messages a second on an input channel, of another publisher or with the ids
// of the owner of the channel, while the vehicle is commanded: the time from an emergency stop on
// BG_STOP to full brake, the cycles of BG, the memory of the nodes, and what they count.
// RCS_STOP_TRIALS: stops under each flood, default 100.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/report.h"
#include "tests/live_faults/live_fault.h"
#include "tools/base/statistics.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kLongest = from_seconds(1.0);   // from a stop to full brake
constexpr Duration kReleased = from_seconds(3.0);  // else the flood is ended for the release
constexpr Duration kRepeat = from_milliseconds(200.0);
constexpr Duration kFloods = from_seconds(2.0);  // before the first stop

/// Those of other publishers are rejected, except on the channels of commands.
constexpr const char* kOfAnother[] = {
    channel::kIns,         channel::kGpsFix,         channel::kOdometry,
    channel::kLadarRanges, channel::kSpRegistration, channel::kSpPoints,
    channel::kWmNavState,  channel::kWmIntegrity,    channel::kWmMapPatch,
    channel::kBgStatus,    channel::kBgDrive,        channel::kUpProcess,
    channel::kWmPathQuery, channel::kBgCommand,      channel::kBgStop};
/// All are accepted. The commands of BG are not among them: the vehicle would obey.
constexpr const char* kOfTheOwner[] = {
    channel::kIns,         channel::kGpsFix,         channel::kOdometry,
    channel::kLadarRanges, channel::kSpRegistration, channel::kSpPoints,
    channel::kWmNavState,  channel::kWmIntegrity,    channel::kWmMapPatch,
    channel::kUpProcess};

struct Row {
  std::vector<double> latencies_ms;
  int without_brake = 0;  ///< stops
  int interrupted = 0;    ///< times that the flood was ended, because a release did not arrive
  int drives = 0;
  double seconds = 0.0;  ///< of the flood, while BG_DRIVE was counted
  double gap_ms = 0.0;   ///< longest between drive commands
  double memory_mb = 0.0;
  std::int64_t counted = 0;  ///< messages of the flood, by the node that has counted most
  std::set<std::string> states;
  bool well_after = false;
};

class StopUnderFlood : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    Bus* const bus = live_.run.bus();
    ASSERT_NE(bus, nullptr) << live_.run.trouble();
    drives_.emplace(bus, channel::kBgDrive, [this](const drive_t& m, Stamp at) { take(m, at); });
    statuses_.emplace(bus, channel::kBgStatus, [this](const status_t& m, Stamp) {
      if (m.publisher_id != bg_) return;
      status_ = m;
      row_.states.insert(m.state);
    });
    arrivals_.emplace(bus, channel::kBgStop, [this](const command_t&, Stamp at) {
      if (!stop_at_) stop_at_ = at;
    });
    for (const std::string& node : kNodes) {
      accounts_.emplace_back(bus, channel_of(node, "CYCLE"), [this](const cycle_t& m, Stamp) {
        for (const input_account_t& i : m.input) {
          if (i.channel == flooded_) counted_[m.node] = i.received + i.rejected + i.malformed;
        }
      });
    }
    stops_.emplace(bus, channel::kBgStop);
    ASSERT_TRUE(live_.run_until_well(kPatience)) << live_.recovery.missing();
    bg_ = newest_publisher_;
  }

  void judge(const std::string& channel, const char* mode, bool must_recover) {
    const int trials = number_from("RCS_STOP_TRIALS", 100);
    flood(channel, mode, trials);
    const tools::Summary s = tools::summarize(row_.latencies_ms);
    const double rate_hz = row_.drives / std::max(row_.seconds, 1e-3);
    std::string states;
    for (const std::string& state : row_.states) states += " " + state;
    fmt::print(
        "{} ({}): {} stops in {:.0f} s, p50 {:.1f}, p99 {:.1f}, max {:.1f} ms, {} times without a "
        "release; {:.1f} drive commands/s, at most {:.0f} ms apart; memory {:+.1f} MB; {} messages "
        "counted; {} afterwards; states{}\n",
        channel, mode, s.count, row_.seconds, s.p50, s.p99, s.max, row_.interrupted, rate_hz,
        row_.gap_ms, row_.memory_mb, row_.counted,
        row_.well_after ? "drives" : live_.recovery.missing(), states);
    EXPECT_EQ(row_.without_brake, 0);
    EXPECT_LE(s.max, milliseconds(kLongest));
    EXPECT_GT(rate_hz, kFloodCycles * 20.0);
    EXPECT_LT(row_.memory_mb, kFloodMemory_mb);
    EXPECT_GT(row_.counted, 0);
    EXPECT_TRUE(row_.well_after || !must_recover) << live_.recovery.missing();
    EXPECT_EQ(live_.run.trouble(), "");
  }

 private:
  void take(const drive_t& m, Stamp at) {
    if (bg_ == 0) newest_publisher_ = m.publisher_id;
    if (m.publisher_id != bg_) return;
    const Duration gap = last_drive_ ? at - *last_drive_ : Duration::zero();
    if (counting_) {
      ++row_.drives;
      row_.gap_ms = std::max(row_.gap_ms, milliseconds(gap));
    }
    last_drive_ = at;
    braked_ = m.brake == 1 && m.emergency_stop == 1 && m.speed_mps == 0.0;
    if (braked_ && !braked_at_) braked_at_ = at;
  }

  void flood(const std::string& channel, const char* mode, int trials) {
    const bool is_stop = channel == channel::kBgStop;
    row_ = Row();
    flooded_ = channel;
    counted_.clear();
    last_drive_.reset();
    live_.run_for(from_seconds(0.5));  // the accounts before the flood
    const std::map<std::string, std::int64_t> counted_before = counted_;
    std::map<std::string, double> before_mb;
    for (const std::string& node : kNodes) before_mb[node] = resident_mb(live_.run.pid_of(node));
    counting_ = true;
    const Stamp begin = live_.run.now();
    if (is_stop) {
      for (int k = 0; k < std::max(1, trials / 10); ++k) stop_by_flood(mode);
    } else {
      begin_flood(mode);
      for (int k = 0; k < trials && live_.run.trouble().empty(); ++k) stop(mode);
    }
    row_.seconds = rcs::seconds(live_.run.now() - begin);
    counting_ = false;
    for (const std::string& node : kNodes) {
      row_.memory_mb =
          std::max(row_.memory_mb, resident_mb(live_.run.pid_of(node)) - before_mb[node]);
    }
    end_flood();
    for (const auto& [node, count] : counted_) {
      const auto before = counted_before.find(node);
      row_.counted =
          std::max(row_.counted, count - (before == counted_before.end() ? 0 : before->second));
    }
    EXPECT_TRUE(release(kPatience)) << channel << ": " << status_.reason;
    live_.recovery.reset();
    row_.well_after = live_.run_until_well(kPatience);
  }

  void begin_flood(const char* mode) {
    const char* const bin = std::getenv("RCS_BIN_DIR");  // NOLINT(concurrency-mt-unsafe)
    Result<cli::ChildProcess> flood = cli::ChildProcess::start(std::string(bin) + "/flood_bus",
                                                               {flooded_, "10000", "100000", mode});
    ASSERT_TRUE(flood.ok()) << flood.error().message;
    flood_.emplace(std::move(flood).value());
    live_.run_for(kFloods);
  }
  void end_flood() {
    if (!flood_) return;
    flood_->send_signal(SIGKILL);
    while (!flood_->collect()) live_.run_for(from_milliseconds(20.0));
    flood_.reset();
  }

  /// A stop at any phase of BG's period, and its release.
  void stop(const char* mode) {
    (void)live_.run.run_until(live_.run.now() + kReleased, [this] { return !braked_; });
    live_.run_for(Duration(std::uniform_int_distribution<>(0, 50'000)(random_)));
    command_t m = command(command_t::KIND_EMERGENCY_STOP);
    m.stop_id = {random_id() | 1};
    m.n_stops = 1;
    braked_at_.reset();
    const bool before = braked_;
    const Stamp sent = live_.run.now();
    Stamp last = sent;
    stops_->publish(&m);
    // A superior sends a stop until it is persisted.
    const auto persisted = [&] {
      if (live_.run.now() - last >= kRepeat) {
        last = live_.run.now();
        stops_->publish(&m);
      }
      return braked_at_ && status_.emergency_stop == status_t::STOP_PERSISTED;
    };
    const bool stopped = live_.run.run_until(sent + kPatience, persisted);
    if (!before && stopped) row_.latencies_ms.push_back(milliseconds(*braked_at_ - sent));
    if (!stopped) ++row_.without_brake;
    if (release(kReleased)) return;
    ++row_.interrupted;
    end_flood();
    EXPECT_TRUE(release(kPatience)) << flooded_ << ": " << status_.reason;
    begin_flood(mode);
  }

  /// The first message of the flood is the stop.
  void stop_by_flood(const char* mode) {
    stop_at_.reset();
    braked_at_.reset();
    begin_flood(mode);
    if (!stop_at_ || !braked_at_) {
      ++row_.without_brake;
    } else {
      row_.latencies_ms.push_back(milliseconds(*braked_at_ - *stop_at_));
    }
    end_flood();
    EXPECT_TRUE(release(kPatience)) << status_.reason;
    (void)live_.run.run_until(live_.run.now() + kPatience, [this] { return !braked_; });
  }

  bool release(Duration most) {
    const Stamp until = live_.run.now() + most;
    Stamp next = live_.run.now();
    const auto released = [&] {
      if (status_.stop.empty() && !braked_) return true;
      if (live_.run.now() < next) return false;
      next = live_.run.now() + kRepeat;
      command_t m = command(command_t::KIND_RELEASE);
      for (const stop_t& s : status_.stop) m.stop_id.push_back(s.id);
      m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
      stops_->publish(&m);
      return false;
    };
    return live_.run.run_until(until, released);
  }

  command_t command(std::int8_t kind) {
    command_t m{};
    m.issuer = "operator";
    m.boot_id = live_.run.bus()->publisher().boot_id;
    m.kind = kind;
    m.utime = m.serial = to_utime(live_.run.now());
    m.valid_until_utime = m.utime + 2'500'000;
    return m;
  }

  LiveFault live_;
  std::mt19937 random_{1};
  std::string flooded_;
  std::optional<cli::ChildProcess> flood_;
  Row row_;
  status_t status_{};
  std::int64_t bg_ = 0;  // publisher
  std::int64_t newest_publisher_ = 0;
  bool braked_ = false;
  bool counting_ = false;  // the drive commands of a flood
  std::optional<Stamp> braked_at_;
  std::optional<Stamp> stop_at_;
  std::optional<Stamp> last_drive_;
  std::map<std::string, std::int64_t> counted_;  // by node
  std::optional<Outbox<command_t>> stops_;
  std::optional<Tap<drive_t>> drives_;
  std::optional<Tap<status_t>> statuses_;
  std::optional<Tap<command_t>> arrivals_;
  std::deque<Tap<cycle_t>> accounts_;
};

class OfAnotherPublisher : public StopUnderFlood {};
TEST_P(OfAnotherPublisher, FullBrakeWithinASecond) { judge(GetParam(), "distinct", true); }
INSTANTIATE_TEST_SUITE_P(StopUnderFlood, OfAnotherPublisher, testing::ValuesIn(kOfAnother),
                         [](const auto& param) { return std::string(param.param); });

/// Such a publisher is not detected, and what it publishes is fused: a known limit.
class WithTheIdsOfTheOwner : public StopUnderFlood {};
TEST_P(WithTheIdsOfTheOwner, FullBrakeWithinASecond) { judge(GetParam(), "owner", false); }
INSTANTIATE_TEST_SUITE_P(StopUnderFlood, WithTheIdsOfTheOwner, testing::ValuesIn(kOfTheOwner),
                         [](const auto& param) { return std::string(param.param); });

}  // namespace
}  // namespace rcs::live_faults
