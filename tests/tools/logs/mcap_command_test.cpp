// `rcs log mcap` and `rcs import mcap`.

#include <gmock/gmock.h>

#include <algorithm>
#include <map>
#include <string>

#include "lcmtypes/channel_types.h"
#include "rcs/node/log/log_file.h"
#include "tests/support/random_message.h"
#include "tests/support/rcs_command.h"
#include "tools/mcap/log_import.h"
#include "tools/mcap/mcap_file.h"
#include "tools/recording/message_fields.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class McapCommand : public RcsCommand {
 protected:
  /// Three random messages on every channel, 0.1 s apart.
  McapCommand() {
    Result<LogWriter> writer = LogWriter::create(log_);
    Stamp stamp = from_utime(1'395'837'296'789'000);
    for (unsigned seed = 1; seed < 4; ++seed) {
      for (const channel::Info& c : channel::kAll) {
        (void)channel::with_type_of(c.name, [&](const auto* type) {
          using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
          const T message = RandomMessage(seed).make<T>();
          std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
          (void)message.encode(bytes.data(), 0, message.getEncodedSize());
          EXPECT_TRUE(writer->write(stamp, c.name, bytes.data(), bytes.size()).ok());
        });
        stamp += from_seconds(0.1);
      }
    }
    EXPECT_TRUE(writer->close().ok());
  }

  std::string log_ = folder_ + "/all.log";
  std::string mcap_ = folder_ + "/all.mcap";
  std::string back_ = folder_ + "/back.log";
};

TEST_F(McapCommand, ALogComesBackWithTheSameBytes) {
  for (const char* options : {"", " --types rcs", " --compression none"}) {
    ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_ + options), 0) << messages();
    ASSERT_EQ(rcs("import mcap " + mcap_ + " -o " + back_), 0) << messages();
    EXPECT_TRUE(text_of(back_) == text_of(log_)) << options;
  }
}

TEST_F(McapCommand, TheSameLogGivesTheSameBytes) {
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_), 0) << messages();
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + folder_ + "/again.mcap"), 0) << messages();
  EXPECT_TRUE(text_of(mcap_) == text_of(folder_ + "/again.mcap"));
}

TEST_F(McapCommand, EveryNumberOfCsvIsInTheFile) {
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_), 0) << messages();
  // By channel: the lines that rcs log csv should print.
  std::map<std::string, std::string> expected;
  Result<mcap::Reader> reader = mcap::open_file(mcap_);
  ASSERT_TRUE(reader.ok());
  mcap::Message m;
  std::vector<std::uint8_t> lcm;
  while (reader->next(&m)) {
    const std::string topic = reader->channel(m.channel_id)->topic;
    if (topic.compare(0, 5, "/rcs/") != 0) continue;
    const std::string channel = topic.substr(5);
    ASSERT_TRUE(mcap::to_lcm(channel, m.data, m.size, &lcm)) << channel;
    const auto fields = recording::read_fields(channel, lcm);
    ASSERT_TRUE(fields.has_value());
    std::string& lines = expected[channel];
    if (lines.empty()) {
      lines = "log_utime";
      for (const auto& [name, value] : *fields) lines += "," + name;
      lines += "\n";
    }
    lines += std::to_string(m.log_time_ns / 1000);
    for (const auto& [name, value] : *fields) lines += "," + value;
    lines += "\n";
  }
  EXPECT_TRUE(reader->health().good()) << reader->health().summary();
  EXPECT_EQ(expected.size(), std::size(channel::kAll));
  for (const auto& [channel, lines] : expected) {
    ASSERT_EQ(rcs("log csv " + log_ + " --channel " + channel), 0);
    std::string csv = out();
    csv.erase(std::remove(csv.begin(), csv.end(), '"'), csv.end());  // quotes of some texts
    std::string unquoted = lines;
    unquoted.erase(std::remove(unquoted.begin(), unquoted.end(), '"'), unquoted.end());
    EXPECT_EQ(csv, unquoted) << channel;
  }
}

TEST_F(McapCommand, ReadersOfFoxgloveFindEveryNumber) {
  if (std::getenv("RCS_NODE_MODULES") == nullptr) {
    GTEST_SKIP() << "NOT RUN: RCS_NODE_MODULES is not set, see tests/tools/mcap/mcap_core_test.sh";
  }
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_), 0) << messages();
  for (const channel::Info& c : channel::kAll) {
    ASSERT_EQ(rcs("log csv " + log_ + " --channel " + c.name), 0);
    std::ofstream(folder_ + "/" + c.name + ".csv") << out();
  }
  const std::string command = "node " + variable("RCS_SOURCE_DIR") +
                              "/tests/tools/mcap/mcap_core_check.mjs " + mcap_ + " " + folder_ +
                              " >" + folder_ + "/said 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0)  // NOLINT(cert-env33-c)
      << text_of(folder_ + "/said");
}

TEST_F(McapCommand, StandardTypesAlone) {
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_ + " --types ros"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("rcl_interfaces/msg/Log"));
  EXPECT_THAT(messages(), Not(HasSubstr("rcs_msgs")));
  EXPECT_EQ(rcs("import mcap " + mcap_ + " -o " + back_), 1);
  EXPECT_THAT(messages(), HasSubstr("no message on a topic /rcs/CHANNEL"));
  EXPECT_FALSE(std::filesystem::exists(back_));
}

TEST_F(McapCommand, ATruncatedFileGivesItsCompleteChunks) {
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_), 0) << messages();
  std::filesystem::resize_file(mcap_, std::filesystem::file_size(mcap_) - 9);
  EXPECT_EQ(rcs("import mcap " + mcap_ + " -o " + back_ + " --json"), 0)
      << "only the footer is missing: " << messages();
  EXPECT_TRUE(text_of(back_) == text_of(log_));
  std::filesystem::resize_file(mcap_, std::filesystem::file_size(mcap_) / 8);
  const int status = rcs("import mcap " + mcap_ + " -o " + back_);
  EXPECT_EQ(status, 1) << messages();
  EXPECT_THAT(messages(), HasSubstr("the file is truncated"));
}

TEST_F(McapCommand, InputsAreProtectedAndErrorsNameFileAndCause) {
  EXPECT_EQ(rcs("log mcap " + log_ + " -o " + log_), 3);
  EXPECT_THAT(messages(), HasSubstr("is also an input of this command"));
  EXPECT_EQ(rcs("log mcap " + folder_ + "/none.log -o " + mcap_), 3);
  EXPECT_THAT(messages(), HasSubstr("none.log: file does not exist"));
  EXPECT_EQ(rcs("log mcap " + log_ + " -o /proc/none/x.mcap"), 3);
  EXPECT_THAT(messages(), HasSubstr("/proc/none/x.mcap: cannot create"));
  EXPECT_EQ(rcs("log mcap " + log_ + " -o /dev/full"), 3);
  EXPECT_THAT(messages(), HasSubstr("/dev/full: cannot write: No space left on device"));
  EXPECT_EQ(rcs("log mcap " + log_ + " -o " + mcap_ + " --compression lz4"), 2);
  EXPECT_EQ(rcs("log mcap " + log_ + " -o " + mcap_ + " --channel CAMERA"), 1);
  EXPECT_THAT(messages(), HasSubstr("no message of this system"));
  EXPECT_EQ(rcs("log mcap " + log_ + " -o " + mcap_ + " --config " + log_), 3);
  EXPECT_FALSE(std::filesystem::exists(mcap_));
  EXPECT_EQ(rcs("import mcap " + log_ + " -o " + back_), 3);
  EXPECT_THAT(messages(), HasSubstr("all.log: not an MCAP file"));
  ASSERT_EQ(rcs("log mcap " + log_ + " -o " + mcap_), 0) << messages();
  EXPECT_EQ(rcs("import mcap " + mcap_ + " -o " + mcap_), 3);
}

TEST_F(McapCommand, UnknownChannelsAreReported) {
  Result<LogWriter> writer = LogWriter::create(folder_ + "/other.log");
  const std::uint8_t byte = 0;
  ASSERT_TRUE(writer->write(from_utime(5), "CAMERA", &byte, 1).ok());
  ASSERT_TRUE(writer->write(from_utime(5), "INS", &byte, 1).ok());
  const ins_t ins{};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(ins.getEncodedSize()));
  (void)ins.encode(bytes.data(), 0, ins.getEncodedSize());
  ASSERT_TRUE(writer->write(from_utime(5), "INS", bytes.data(), bytes.size()).ok());
  ASSERT_TRUE(writer->close().ok());
  ASSERT_EQ(rcs("log mcap " + folder_ + "/other.log -o " + mcap_), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("not included: CAMERA (1 events)"));
  EXPECT_THAT(messages(),
              HasSubstr("not included: INS (1 messages), not of the type of the channel"));
}

}  // namespace
}  // namespace rcs::test
