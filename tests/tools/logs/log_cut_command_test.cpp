// `rcs log cut`: sections by time and around events, of logs and recordings.

#include <gmock/gmock.h>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/node/log/log_file.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

class LogCutCommand : public RcsCommand {
 protected:
  /// INS every 0.1 s for 100 s in two segments; the event fde at 20, 50.05 and 80 s, and others.
  LogCutCommand() {
    std::filesystem::create_directories(recording_);
    for (int k = 0; k < 2; ++k) {
      Result<LogWriter> writer = LogWriter::create(recording_ + "/rcs-0000000" +
                                                   std::to_string(k + 1) + "-20140326T123456Z.log");
      for (int i = 500 * k; i < 500 * (k + 1); ++i) {
        const std::uint8_t byte = 0;
        const Stamp stamp = kBegin + from_milliseconds(100.0 * i);
        EXPECT_TRUE(writer->write(stamp, "INS", &byte, 1).ok());
        if (i == 200 || i == 800) write_event(stamp, channel::kWmEvent, "fde", &writer.value());
        if (i == 500) {
          write_event(stamp + from_milliseconds(50.0), channel::kWmEvent, "fde", &writer.value());
        }
        if (i == 300) write_event(stamp, channel::kBgEvent, "stop.engaged", &writer.value());
        if (i == 310) write_event(stamp, "CAMERA", "fde", &writer.value());
      }
      EXPECT_TRUE(writer->close().ok());
    }
  }
  static void write_event(Stamp stamp, const char* channel, const char* code, LogWriter* writer) {
    event_t m{};
    m.code = code;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
    (void)m.encode(bytes.data(), 0, m.getEncodedSize());
    EXPECT_TRUE(writer->write(stamp, channel, bytes.data(), bytes.size()).ok());
  }
  int cut(const std::string& options) {
    std::filesystem::remove(out_);
    return rcs("log cut " + recording_ + " -o " + out_ + " " + options);
  }
  /// First and last stamp of the cut log, in seconds of the recording, and the number of events.
  struct Section {
    double first_s = -1.0;
    double last_s = -1.0;
    int events = 0;
  };
  [[nodiscard]] Section section() const {
    Section s;
    Result<LogReader> reader = LogReader::open(out_);
    EXPECT_TRUE(reader.ok());
    LogEvent event;
    while (reader.ok() && reader->next(&event)) {
      if (s.events++ == 0) s.first_s = seconds(event.stamp - kBegin);
      s.last_s = seconds(event.stamp - kBegin);
    }
    return s;
  }

  static constexpr Stamp kBegin = from_utime(1'395'837'296'789'000);  // 12:34:56.789 UTC
  std::string recording_ = folder_ + "/recording";
  std::string out_ = folder_ + "/part.log";
};

TEST_F(LogCutCommand, TheTimeAroundTheFirstOccurrence) {
  EXPECT_EQ(cut("--around fde"), 0) << messages();
  EXPECT_NEAR(section().first_s, 10.0, 1e-6);
  EXPECT_NEAR(section().last_s, 30.0, 1e-6);
  EXPECT_EQ(section().events, 203) << "201 of INS, the event, and stop.engaged at 30 s";
  EXPECT_THAT(messages(), HasSubstr("fde of WM: occurrence 1 of 3, 2014-03-26 12:35:16.789 UTC"));
}

TEST_F(LogCutCommand, AnyOccurrenceWithItsMargins) {
  EXPECT_EQ(cut("--around fde --occurrence 2 --before 1 --after 2.5"), 0) << messages();
  EXPECT_NEAR(section().first_s, 49.1, 1e-6) << "the section begins in the first segment";
  EXPECT_NEAR(section().last_s, 52.5, 1e-6);
  EXPECT_EQ(cut("--around fde --occurrence -1 --before 0 --after 0"), 0) << messages();
  EXPECT_NEAR(section().first_s, 80.0, 1e-6);
  EXPECT_EQ(section().events, 2) << "INS of the same time, and the event";
  EXPECT_EQ(cut("--around stop.engaged --channel BG_EVENT"), 0) << messages();
  EXPECT_EQ(section().events, 1);
  EXPECT_EQ(cut("--around fde --before 1000 --after 1000 --json"), 0) << messages();
  EXPECT_EQ(section().events, 1005);
  EXPECT_THAT(out(), HasSubstr("\"occurrences\": 3"));
}

TEST_F(LogCutCommand, AnEventThatDoesNotOccurIsANegativeResult) {
  EXPECT_EQ(cut("--around solution.lost"), 1);
  EXPECT_THAT(messages(), HasSubstr("the event solution.lost does not occur"));
  EXPECT_EQ(cut("--around fde --occurrence 4"), 1);
  EXPECT_THAT(messages(), HasSubstr("occurs 3 times, there is no occurrence 4"));
  EXPECT_EQ(cut("--around fde --occurrence -4"), 1);
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(LogCutCommand, InvalidCommandLinesAreExplained) {
  EXPECT_EQ(cut("--around solution.lots"), 2);
  EXPECT_THAT(messages(), HasSubstr("no such event; did you mean solution.lost?"));
  EXPECT_EQ(cut("--around fde --from 3"), 2);
  EXPECT_EQ(cut("--before 3"), 2);
  EXPECT_EQ(cut("--around fde --occurrence 0"), 2);
  EXPECT_EQ(cut("--around fde --before -1"), 2);
}

TEST_F(LogCutCommand, ARecordingBecomesOneLog) {
  EXPECT_EQ(cut(""), 0) << messages();
  EXPECT_EQ(section().events, 1005);
  EXPECT_EQ(cut("--from 49.5 --to 50.5"), 0) << messages();
  EXPECT_NEAR(section().first_s, 49.5, 1e-6);
  EXPECT_NEAR(section().last_s, 50.4, 1e-6);
  EXPECT_EQ(rcs("eval " + recording_), 3);
  EXPECT_THAT(messages(),
              HasSubstr("the folder of a recording; make one log of it by `rcs log cut"));
  // A segment is an input: it is not replaced.
  EXPECT_EQ(
      rcs("log cut " + recording_ + " -o " + recording_ + "/rcs-00000001-20140326T123456Z.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("is also an input of this command"));
}

}  // namespace
}  // namespace rcs::test
