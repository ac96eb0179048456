#include "rcs/node/report.h"
#include "lcmtypes/events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/local_bus.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::ms;

using event::Limit;
using event::Severity;
constexpr event::Info kRejected{"sp", "icp.rejected", Severity::kWarning, Limit::kOne, "", "", ""};
constexpr event::Info kA{"sp", "a", Severity::kInfo, Limit::kOne, "", "", ""};
constexpr event::Info kB{"sp", "b", Severity::kError, Limit::kOne, "", "", ""};
constexpr event::Info kState{"sp", "state", Severity::kWarning, Limit::kTen, "", "", ""};
constexpr event::Info kOther{"sp", "other", Severity::kWarning, Limit::kTen, "", "", ""};

class ReportTest : public testing::Test {
 protected:
  const event_t* next() {
    if (started_) events_.pop();
    started_ = true;
    return events_.front();
  }
  void deliver() {
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(Stamp());
  }
  LocalBus bus_;
  Inbox<event_t> events_{&bus_, "SP_EVENT", 16};
  Report report_{&bus_, "sp", ms(1000)};
  bool started_ = false;
};

TEST_F(ReportTest, AnEventHasSourceCodeAndTime) {
  report_.publish(at_ms(5), kRejected, "nis {:.1f} > {:.1f}, pairs {}", 12.34, 5.0, 77);
  deliver();
  const event_t* e = next();
  ASSERT_NE(e, nullptr);
  EXPECT_EQ(e->node, "sp");
  EXPECT_EQ(e->utime, 5000);
  EXPECT_EQ(e->severity, int{event_t::SEVERITY_WARNING});
  EXPECT_EQ(e->code, "icp.rejected");
  EXPECT_EQ(e->text, "nis 12.3 > 5.0, pairs 77");
  EXPECT_EQ(e->repeated, 0);
}

TEST_F(ReportTest, ACodeIsSentOncePerIntervalAndTheRestIsCounted) {
  for (std::int64_t i = 0; i < 250; ++i) report_.publish(at_ms(10 * i), kA, "number {}", i);
  report_.publish(at_ms(10), kB, "another code is not held back");
  deliver();
  EXPECT_EQ(next()->text, "number 0");
  const event_t* second = next();
  EXPECT_EQ(second->text, "number 100");
  EXPECT_EQ(second->repeated, 99);
  const event_t* third = next();
  EXPECT_EQ(third->text, "number 200");
  EXPECT_EQ(third->repeated, 99);
  EXPECT_EQ(next()->code, "b");
  EXPECT_EQ(next(), nullptr);
}

TEST_F(ReportTest, TheEndOfAStateIsPublishedAndAFlappingStateIsLimited) {
  report_.publish(at_ms(0), kState, "INS silent");
  report_.publish_end(at_ms(300), kState, "INS received again");
  deliver();
  EXPECT_EQ(next()->text, "INS silent");
  EXPECT_EQ(events_.front()->severity, int{event_t::SEVERITY_WARNING});
  EXPECT_EQ(next()->text, "INS received again");
  EXPECT_EQ(events_.front()->severity, int{event_t::SEVERITY_INFO});
  EXPECT_EQ(next(), nullptr);

  started_ = false;
  for (int i = 0; i < 500; ++i) report_.publish(at_ms(2000 + i), kOther, "{}", i);
  report_.publish(at_ms(3100), kOther, "last");
  deliver();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(next()->text, std::to_string(i));
  const event_t* last = next();
  EXPECT_EQ(last->text, "last");
  EXPECT_EQ(last->repeated, 490);
  EXPECT_EQ(next(), nullptr);
}

TEST_F(ReportTest, ThePrinterShowsAnEventInOneLine) {
  EventPrinter printer(&bus_, "sp");
  report_.publish(at_ms(1500), event::kSpMapReseeded, "after {} failures", 5);
  testing::internal::CaptureStderr();
  deliver();
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::MatchesRegex("sp [0-9][0-9]:[0-9][0-9]:[0-9][0-9].[0-9][0-9][0-9] UTC, "
                                    "[0-9]+.[0-9] s error: map.reseeded: after 5 failures\n"));
}

}  // namespace
}  // namespace rcs
