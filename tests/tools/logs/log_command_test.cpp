// `rcs log` knows every channel of the table.

#include <gmock/gmock.h>

#include <sstream>

#include "lcmtypes/channel_types.h"
#include "rcs/node/log/log_file.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr Stamp kBegin = from_utime(1'395'837'296'789'000);  // 12:34:56.789 UTC

class LogCommand : public RcsCommand {
 protected:
  /// A message on every channel, 0.1 s apart, and one on a foreign channel.
  LogCommand() : log_(folder_ + "/all.log") {
    Result<LogWriter> writer = LogWriter::create(log_);
    Stamp stamp = kBegin;
    for (const channel::Info& c : channel::kAll) {
      (void)channel::with_type_of(c.name, [&](const auto* type) {
        std::remove_const_t<std::remove_pointer_t<decltype(type)>> message{};
        message.run_id = 0x2c;
        message.publisher_id = 0x5b3c1d2e4f607182;
        std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
        (void)message.encode(bytes.data(), 0, message.getEncodedSize());
        EXPECT_TRUE(writer->write(stamp, c.name, bytes.data(), bytes.size()).ok());
      });
      stamp += from_seconds(0.1);
    }
    EXPECT_TRUE(writer->write(stamp, "CAMERA", nullptr, 0).ok());
    EXPECT_TRUE(writer->close().ok());
  }
  std::string log_;
};

TEST_F(LogCommand, InfoListAndCsvKnowEveryChannel) {
  EXPECT_EQ(rcs("log info " + log_), 0) << messages();
  const std::string info = out();
  EXPECT_THAT(info, HasSubstr("first event: 2014-03-26 12:34:56.789 UTC"));
  EXPECT_THAT(info, testing::ContainsRegex("CAMERA .*not a channel of this system"));
  EXPECT_EQ(rcs("log list " + log_), 0) << messages();
  const std::string list = out();
  EXPECT_THAT(list, HasSubstr("\n12:34:56.889    0.100000 "));
  for (const channel::Info& c : channel::kAll) {
    const std::string name = std::string("\n") + c.name + " ";
    const std::size_t at = info.find(name);
    ASSERT_NE(at, std::string::npos) << c.name;
    EXPECT_THAT(info.substr(at + 1, info.find('\n', at + 1) - at), Not(HasSubstr("not a channel")));
    EXPECT_THAT(list, HasSubstr(std::string(" ") + c.name + " "));
    EXPECT_THAT(list, testing::ContainsRegex(std::string(" ") + c.name + " .* 5b3c1d2e4f607182\n"));
    EXPECT_EQ(rcs("log csv " + log_ + " --channel " + c.name), 0) << c.name << messages();
    EXPECT_THAT(out(), HasSubstr("log_utime,utime,")) << c.name;
  }
  for (const std::string& text : {info, list}) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.find(folder_) != std::string::npos) continue;
      EXPECT_LE(line.size(), 100U) << line;
    }
  }
}

TEST_F(LogCommand, ListNamesThePublisherOfEveryMessage) {
  EXPECT_EQ(rcs("log list --json " + log_), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("\"publisher_id\":\"5b3c1d2e4f607182\",\"run_id\":\"2c\""));
  EXPECT_THAT(out(), testing::ContainsRegex("CAMERA.*\"publisher_id\":null,\"run_id\":null"));
}

}  // namespace
}  // namespace rcs::test
