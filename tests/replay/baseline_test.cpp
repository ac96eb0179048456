// Change indication: outputs of SP, WM and BG on fixed inputs, compared with the values in
// tests/replay/baselines. A commit that changes a value on purpose updates them and gives the
// reason:
//   RCS_UPDATE_BASELINES=1 tools/test -R Baseline
// A baseline has one file for each channel: thinned rows of the channel's table below a first line
// with the number and the checksum of all rows. Each instruction set sums in another order and has
// baselines of its own (x86-64-v3: avx2, x86-64-v2: sse).

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/node/log/log_file.h"
#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tests/replay/real_data.h"
#include "tools/driving/closed_loop.h"
#include "tools/recording/message_fields.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

#if defined(__AVX2__)
constexpr char kInstructionSet[] = "avx2";
#elif defined(__SSE2__)
constexpr char kInstructionSet[] = "sse";
#else
constexpr char kInstructionSet[] = "other";
#endif

/// Compared channels, and the number of rows of which one is kept.
struct Thinned {
  const char* channel;
  std::size_t every;
};
constexpr Thinned kChannels[] = {
    {channel::kSpRegistration, 20}, {channel::kSpPoints, 50},      {channel::kSpEvent, 1},
    {channel::kWmNavState, 100},    {channel::kWmInnovation, 400}, {channel::kWmIntegrity, 20},
    {channel::kWmSubfilter, 20},    {channel::kWmMapPatch, 20},    {channel::kWmEvent, 1},
    {channel::kBgStatus, 50},       {channel::kBgPlan, 20},        {channel::kBgDrive, 40},
    {channel::kBgEvent, 1},
};

using Row = std::vector<std::string>;

struct ChannelTable {
  std::string heading;  ///< rows, checksum
  std::vector<Row> rows;
};

std::uint64_t fnv1a(std::uint64_t hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

/// A run's id depends on the text of the configuration, comments included.
bool is_id(const std::string& column) { return column == "run_id" || column == "publisher_id"; }

/// Collects the messages of a channel.
class TableBuilder {
 public:
  void add(Stamp stamp, const recording::Fields& fields, std::size_t every) {
    if (count_ == 0) {
      Row names = {"log_utime"};
      for (const auto& [name, value] : fields) {
        if (!is_id(name)) names.push_back(name);
      }
      rows_.push_back(std::move(names));
    }
    Row row = {std::to_string(to_utime(stamp))};
    for (const auto& [name, value] : fields) {
      if (!is_id(name)) row.push_back(value);
    }
    for (const std::string& cell : row) hash_ = fnv1a(fnv1a(hash_, cell), "\x1f");
    if (count_++ % every == 0) rows_.push_back(std::move(row));
  }
  [[nodiscard]] ChannelTable table() const {
    return {fmt::format("# {} messages, checksum {:016x}", count_, hash_), rows_};
  }

 private:
  std::size_t count_ = 0;
  std::uint64_t hash_ = 14695981039346656037ULL;
  std::vector<Row> rows_;
};

/// By channel.
class RunTables final : public BusTap {
 public:
  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override {
    for (const Thinned& c : kChannels) {
      if (channel != c.channel) continue;
      const auto fields = recording::read_fields(channel, {data, data + size});
      ASSERT_TRUE(fields.has_value()) << channel;
      builders_[c.channel].add(due, *fields, c.every);
    }
  }
  [[nodiscard]] std::map<std::string, ChannelTable> tables() const {
    std::map<std::string, ChannelTable> all;
    for (const auto& [channel, builder] : builders_) all[channel] = builder.table();
    return all;
  }

 private:
  std::map<std::string, TableBuilder> builders_;
};

std::map<std::string, ChannelTable> tables_of_log(const std::string& path) {
  RunTables tables;
  Result<LogReader> reader = LogReader::open(path);
  RCS_CHECK(reader.ok());
  LogEvent event;
  while (reader->next(&event)) {
    tables.on_deliver(event.stamp, event.channel, event.data.data(), event.data.size());
  }
  return tables.tables();
}

// ---- files: cells between tabs, since texts of events have commas -----------------------------

void write_table(const std::string& path, const ChannelTable& table) {
  std::ofstream out(path);
  out << table.heading << "\n";
  for (const Row& row : table.rows) {
    for (std::size_t k = 0; k < row.size(); ++k) out << (k == 0 ? "" : "\t") << row[k];
    out << "\n";
  }
}

ChannelTable read_table(const std::string& path) {
  ChannelTable table;
  std::ifstream in(path);
  std::getline(in, table.heading);
  for (std::string line; std::getline(in, line);) {
    Row row(1);
    for (const char c : line) {
      if (c == '\t') {
        row.emplace_back();
      } else {
        row.back() += c;
      }
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

// ---- comparison ---------------------------------------------------------------------------------

/// The first differences of one channel, as "row 12, p_world_vehicle_m_0: 1.5 instead of 1.4".
std::vector<std::string> differences(const ChannelTable& now, const ChannelTable& before) {
  std::vector<std::string> found;
  if (now.heading != before.heading) {
    found.push_back("now:    " + now.heading);
    found.push_back("before: " + before.heading);
  }
  if (now.rows.size() != before.rows.size()) {
    found.push_back(fmt::format("{} rows instead of {}", now.rows.size(), before.rows.size()));
  }
  for (std::size_t r = 0; r < std::min(now.rows.size(), before.rows.size()); ++r) {
    const Row& a = now.rows[r];
    const Row& b = before.rows[r];
    if (a.size() != b.size()) {
      found.push_back(fmt::format("{} columns instead of {}", a.size(), b.size()));
      break;
    }
    for (std::size_t c = 0; c < a.size() && found.size() < 12; ++c) {
      const std::string& column = before.rows.front()[c];
      if (a[c] == b[c]) continue;
      found.push_back(fmt::format("row {}, {}: {} instead of {}", r, column, a[c], b[c]));
    }
  }
  return found;
}

void compare_with_baseline(const std::string& name,
                           const std::map<std::string, ChannelTable>& tables) {
  const std::string folder =
      source_path(std::string("tests/replay/baselines/") + kInstructionSet + "/" + name);
  if (std::getenv("RCS_UPDATE_BASELINES") != nullptr) {
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const auto& [channel, table] : tables) {
      write_table(fs::path(folder) / (channel + ".tsv"), table);
    }
    std::printf("baselines written to %s\n", folder.c_str());
  }
  ASSERT_FALSE(tables.empty());
  if (!fs::exists(folder)) {
    GTEST_SKIP() << "SKIPPED: no baselines of this instruction set (" << kInstructionSet << ")";
  }
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    ++files;
    const std::string channel = entry.path().stem();
    const auto it = tables.find(channel);
    if (it == tables.end()) {
      ADD_FAILURE() << name << ": no message on " << channel << " any more";
      continue;
    }
    const ChannelTable before = read_table(entry.path());
    ASSERT_FALSE(before.rows.empty()) << entry.path();
    for (const std::string& line : differences(it->second, before)) {
      ADD_FAILURE() << name << ", " << channel << ": " << line;
    }
  }
  EXPECT_EQ(files, tables.size()) << name << ": channels that have no baseline";
}

std::string rcs_command() {
  const char* folder = std::getenv("RCS_BIN_DIR");
  return std::string(folder == nullptr ? "." : folder) + "/rcs ";
}

void must(const std::string& command) {
  ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0) << command;  // NOLINT
}

class Baseline : public testing::Test {
 protected:
  Baseline() {
    folder_ = (fs::temp_directory_path() / "rcs_baseline_XXXXXX").string();
    RCS_CHECK(mkdtemp(folder_.data()) != nullptr);
  }
  ~Baseline() override { fs::remove_all(folder_); }

  /// 20 s of a simulated drive through SP and WM.
  void simulated_replay(const std::string& scenario, const std::string& vehicle) {
    must(rcs_command() + "sim " + source_path("config/sim/" + scenario) + " --duration 20 -o " +
         folder_ + "/in.log");
    must(rcs_command() + "replay " + source_path("config/" + vehicle) + " " + folder_ +
         "/in.log -o " + folder_ + "/out.log");
  }

  std::string folder_;
};

TEST_F(Baseline, ReplayOfARangeImager) {
  simulated_replay("reference.toml", "demo3.toml");
  compare_with_baseline("demo3", tables_of_log(folder_ + "/out.log"));
}

TEST_F(Baseline, ReplayOfASpinningLadar) {
  simulated_replay("spinning64.toml", "spinning64.toml");
  compare_with_baseline("spinning64", tables_of_log(folder_ + "/out.log"));
}

TEST_F(Baseline, ReplayOfKitti) {
  const std::string scans = unpacked("kitti_2011_09_26_drive_0005/velodyne_bin_000-079.tar.xz");
  if (scans.empty()) GTEST_SKIP() << kNoData;
  const std::string data = data_path("kitti_2011_09_26_drive_0005");
  must(rcs_command() + "import kitti --scans " + scans + " --poses " + data +
       "/poses/oxts_imu_poses_kitti.txt --calib " + data + "/calib -o " + folder_ + "/in.log");
  must(rcs_command() + "replay " + source_path("config/kitti.toml") + " " + folder_ +
       "/in.log -o " + folder_ + "/out.log");
  fs::remove_all(scans);
  compare_with_baseline("kitti", tables_of_log(folder_ + "/out.log"));
}

TEST_F(Baseline, ClosedLoopWithBg) {
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), {});
  ASSERT_TRUE(scenario.ok());
  RunTables tables;
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  options.tap = &tables;
  const driving::ClosedLoopRun run = driving::run_closed_loop(*scenario, options, driving::make_bg);
  EXPECT_TRUE(run.done) << run.reason;
  compare_with_baseline("closed_loop", tables.tables());
}

}  // namespace
}  // namespace rcs::test
