// What the recorder publishes about itself.

#include "tools/recorder/recorder_report.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/local_bus.h"

namespace rcs::recorder {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class RecorderReportTest : public testing::Test {
 protected:
  std::vector<std::string> update(double at_s) {
    if (!hangs_) ++state_.cycles;
    std::vector<std::string> texts = report_.update(from_utime(0) + from_seconds(at_s), state_);
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(Stamp());
    return texts;
  }
  /// Code and severity of the waiting events.
  std::vector<std::pair<std::string, int>> events() {
    std::vector<std::pair<std::string, int>> codes;
    for (; const event_t* e = events_.front(); events_.pop())
      codes.emplace_back(e->code, e->severity);
    return codes;
  }

  LocalBus bus_;
  Inbox<event_t> events_{&bus_, channel::kRecordEvent, 16};
  Inbox<process_t> processes_{&bus_, channel::kRecordProcess, 16};
  RecorderReport report_{&bus_, RecorderParams{}, "/data/rec", from_utime(0)};
  RecorderThread::State state_;
  bool hangs_ = false;
};

TEST_F(RecorderReportTest, AnUndisturbedRecorderIsAlive) {
  EXPECT_THAT(update(0.0), IsEmpty());
  EXPECT_THAT(update(1.0), IsEmpty());
  EXPECT_THAT(events(), IsEmpty());
  EXPECT_EQ(processes_.size(), 2U);
  EXPECT_EQ(processes_.front()->node, "record");
  EXPECT_EQ(processes_.front()->config, "/data/rec");
}

TEST_F(RecorderReportTest, AStopAndItsEndAreReportedAtOnce) {
  state_.recorder.stopped_by = ENOSPC;
  state_.recorder.free_bytes = 12'000'000;
  const std::vector<std::string> stopped = update(0.0);
  ASSERT_THAT(stopped, SizeIs(1));
  EXPECT_THAT(stopped[0], HasSubstr("recording stopped: disk full (12 MB free, reserve 268 MB) and "
                                    "nothing left to delete"));
  EXPECT_THAT(processes_.latest()->note, HasSubstr("recording stopped"));
  EXPECT_THAT(update(1.0), IsEmpty());
  state_.recorder.stopped_by = 0;
  state_.recorder.messages_lost = 33;
  EXPECT_THAT(update(2.0),
              testing::ElementsAre("recording continues: 33 messages were not recorded so far"));
  EXPECT_EQ(processes_.latest()->note, "");
  EXPECT_THAT(events(),
              testing::ElementsAre(std::pair("record.stopped", int{event_t::SEVERITY_ERROR}),
                                   std::pair("record.stopped", int{event_t::SEVERITY_INFO})));
  state_.recorder.stopped_by = EIO;
  EXPECT_THAT(update(3.0)[0], HasSubstr("Input/output error"));
  state_.recorder.stopped_by = 0;
  EXPECT_THAT(update(4.0), SizeIs(1));
  state_.recorder.messages_lost = 40;  // a stop that ended before it was seen
  EXPECT_THAT(update(5.0), testing::ElementsAre(HasSubstr("40 messages were not recorded")));
  EXPECT_THAT(update(6.0), IsEmpty());
}

TEST_F(RecorderReportTest, LossesAreReportedWithTheirNumbersEveryFiveSeconds) {
  state_.recorder.shed_for_space = 2;
  state_.recorder.shed_for_space_bytes = 128'000'000;
  state_.queue.dropped = 7;
  state_.queue.rejected = 3;
  state_.recorder.audit_lines_lost = 1;
  state_.max_exposure = from_seconds(1.5);
  EXPECT_THAT(
      update(0.0),
      testing::ElementsAre(HasSubstr("2 segments (128.0 MB) deleted, the oldest first"),
                           HasSubstr("7 messages dropped"), HasSubstr("3 messages not recorded"),
                           HasSubstr("1 lines of the audit log lost"), HasSubstr("cost 1.5 s")));
  state_.max_exposure = Duration::zero();
  state_.queue.dropped = 9;
  EXPECT_THAT(update(1.0), IsEmpty());
  EXPECT_THAT(update(5.0), testing::ElementsAre(HasSubstr("2 messages dropped")));
  EXPECT_THAT(update(20.0), IsEmpty());
  EXPECT_THAT(events(), SizeIs(6));
}

TEST_F(RecorderReportTest, ADiskThatDoesNotRespondIsReportedWhileItDoesNot) {
  EXPECT_THAT(update(0.0), IsEmpty());
  hangs_ = true;
  EXPECT_THAT(update(1.0), IsEmpty());
  EXPECT_THAT(update(2.0), testing::ElementsAre(HasSubstr("cost 2.0 s")));
  EXPECT_EQ(processes_.size(), 3U) << "the recorder is alive";
}

}  // namespace
}  // namespace rcs::recorder
