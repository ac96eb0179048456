// Hostile logs through `rcs replay`, the program (the reader by itself:
// tests/node/log_file_test.cpp).

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "rcs/node/log/log_file.h"
#include "tests/replay/hostile_drive.h"

namespace rcs::test {
namespace {

std::string temp_path(const std::string& name) {
  return testing::TempDir() + "hostile_log_" + name;
}

/// A log of the sensors of a clean drive with packets among them.
std::string sensor_log(const std::vector<std::pair<std::string, Bytes>>& packets) {
  class Recorder final : public BusTap {
   public:
    explicit Recorder(LogWriter* log) : log_(*log) {}
    void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                    std::size_t size) override {
      EXPECT_TRUE(log_.write(due, channel, data, size).ok());
    }

   private:
    LogWriter& log_;
  };
  std::string path = temp_path("drive.log");
  Result<LogWriter> log = LogWriter::create(path);
  Recorder recorder(&log.value());
  hostile_drive("NOBODY", {}, &recorder);
  for (const auto& [channel, bytes] : packets) {
    recorder.on_deliver(from_utime(1'001'300'000), channel, bytes.data(), bytes.size());
  }
  EXPECT_TRUE(log->close().ok());
  return path;
}

/// Output of `rcs replay` for a log.
struct Replayed {
  int status = -1;
  std::string text;
};
Replayed replay(const std::string& log) {
  const std::string config = temp_path("config.toml");
  std::ofstream(config) << hostile_drive_config();
  const char* folder = std::getenv("RCS_BIN_DIR");
  const std::string said = temp_path("said.txt");
  const std::string command = std::string(folder == nullptr ? "." : folder) + "/rcs replay " +
                              config + " " + log + " -o " + temp_path("result.log") + " >" + said +
                              " 2>&1";
  Replayed out;
  out.status = std::system(command.c_str());  // NOLINT
  std::ifstream in(said);
  out.text = {std::istreambuf_iterator<char>(in), {}};
  return out;
}

TEST(HostileLog, AReplayReportsUnreadableEventsAndContinues) {
  const Bytes garbage(50, 0xed);
  const std::string log = sensor_log({{channel::kIns, garbage}, {channel::kLadarRanges, garbage}});
  const Replayed whole = replay(log);
  EXPECT_EQ(whole.status, 0) << whole.text;
  // received, dropped, gaps, repeated, malformed, rejected
  const std::regex one_malformed("INS +[0-9]+ +0 +0 +0 +1 +0\n");
  EXPECT_TRUE(std::regex_search(whole.text, one_malformed)) << whole.text;

  std::ifstream in(log, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  bytes.resize(bytes.size() - 20);
  bytes.replace(bytes.size() / 2, 4000, std::string(4000, '\xff'));
  std::ofstream(log, std::ios::binary) << bytes;
  const Replayed damaged = replay(log);
  EXPECT_EQ(damaged.status, 0) << damaged.text;
  EXPECT_NE(damaged.text.find("unreadable bytes"), std::string::npos) << damaged.text;
  EXPECT_NE(damaged.text.find("truncated"), std::string::npos) << damaged.text;

  std::ofstream(log, std::ios::binary) << std::string(1000, '\xa1');
  const Replayed noise = replay(log);
  EXPECT_NE(noise.status, 0);
  EXPECT_NE(noise.text.find("no sensor message"), std::string::npos) << noise.text;
}

}  // namespace
}  // namespace rcs::test
