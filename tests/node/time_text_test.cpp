#include "rcs/node/time_text.h"

#include <gtest/gtest.h>

#include <limits>

namespace rcs {
namespace {

TEST(TimeText, IsTheUtcTimeOfTheStamp) {
  // `date -u -d 2014-03-26T12:34:56 +%s`
  constexpr std::int64_t kUtime = 1'395'837'296'789'999;
  EXPECT_EQ(time_of_day(kUtime), "12:34:56.789");
  EXPECT_EQ(utc_date(kUtime), "2014-03-26");
  EXPECT_EQ(time_of_day(0), "00:00:00.000");
  EXPECT_EQ(utc_date(0), "1970-01-01");
  EXPECT_EQ(time_of_day(-1), "23:59:59.999");
  EXPECT_EQ(utc_date(-1), "1969-12-31");
}

TEST(TimeText, AnyStampHasAText) {
  for (const std::int64_t utime :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(time_of_day(utime).size(), 12U);
    EXPECT_FALSE(utc_date(utime).empty());
  }
}

}  // namespace
}  // namespace rcs
