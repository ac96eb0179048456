#include "tools/rcs/vehicle/run_lock.h"

#include <gtest/gtest.h>

namespace rcs::cli {
namespace {

TEST(RunLock, EverySpellingOfAnAddressIsOneBus) {
  for (const char* url : {"udpm://", "udpm://?ttl=0", "udpm://239.255.76.67:7667",
                          "udpm://239.255.76.67:07667", "udpm://239.255.76.67:7667?ttl=1",
                          "udpm://239.255.76.67:7667?recv_buf_size=4194304&ttl=0"}) {
    EXPECT_EQ(bus_name(url), "udpm://239.255.76.67:7667") << url;
  }
  EXPECT_NE(bus_name("udpm://239.255.76.67:7668"), bus_name("udpm://"));
  EXPECT_NE(bus_name("udpm://239.255.76.68:7667"), bus_name("udpm://"));
  EXPECT_EQ(bus_name("file:///tmp/a.log?mode=r"), "file:///tmp/a.log");
}

TEST(RunLock, OnlyOneProcessHoldsTheLockOfABus) {
  const Result<RunLock> first = RunLock::take("udpm://239.1.2.3:43210?ttl=0");
  ASSERT_TRUE(first.ok());
  const Result<RunLock> second = RunLock::take("udpm://239.1.2.3:043210");
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("another `rcs up` runs on udpm://239.1.2.3:43210"),
            std::string::npos);
  EXPECT_TRUE(RunLock::take("udpm://239.1.2.3:43211").ok());
}

}  // namespace
}  // namespace rcs::cli
