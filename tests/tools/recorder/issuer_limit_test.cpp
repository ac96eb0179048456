#include "tools/recorder/issuer_limit.h"

#include <gtest/gtest.h>

namespace rcs::recorder {
namespace {

constexpr Stamp at(double s) { return Stamp(from_seconds(1000.0 + s)); }

int admitted(IssuerLimit* limit, std::string_view issuer, int messages, double at_s) {
  int n = 0;
  for (int k = 0; k < messages; ++k) {
    (void)limit->note(issuer, at(at_s));
    n += limit->admit(issuer, at(at_s)) ? 1 : 0;
  }
  return n;
}

TEST(IssuerLimit, ABurstThenTwoPerSecond) {
  IssuerLimit limit;
  EXPECT_EQ(admitted(&limit, "alice", 10'000, 0.0), IssuerLimit::kBurst);
  EXPECT_EQ(admitted(&limit, "alice", 10'000, 10.0), 20);
  EXPECT_EQ(admitted(&limit, "bob", 100, 10.0), 100) << "each has its own";
  EXPECT_EQ(admitted(&limit, "alice", 10'000, 1e6), IssuerLimit::kBurst);
  const std::vector<IssuerLimit::Suppressed> all = limit.take_suppressed();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].issuer, "alice");
  EXPECT_EQ(all[0].lines, 30'000 - 2 * IssuerLimit::kBurst - 20);
  EXPECT_FALSE(limit.suppresses());
  EXPECT_TRUE(limit.take_suppressed().empty());
}

TEST(IssuerLimit, ACommandEverySecondIsNeverSuppressed) {
  IssuerLimit limit;
  for (int k = 0; k < 10'000; ++k) EXPECT_EQ(admitted(&limit, "gateway", 1, k), 1);
}

TEST(IssuerLimit, EverNewNamesShareOneLimit) {
  IssuerLimit limit;
  EXPECT_TRUE(limit.note("operator", at(0.0)));
  int n = 0;
  for (int k = 0; k < 100'000; ++k) n += admitted(&limit, "x" + std::to_string(k), 1, 1.0);
  const int others = static_cast<int>(IssuerLimit::kMaxIssuers) - 1;
  EXPECT_EQ(n, others + IssuerLimit::kBurst);
  EXPECT_EQ(admitted(&limit, "operator", 5, 2.0), 5);
  const std::vector<IssuerLimit::Suppressed> all = limit.take_suppressed();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_TRUE(all[0].of_others);
  EXPECT_EQ(all[0].lines, 100'000 - n);
  // Places of issuers that have been silent for long are given away.
  const double later_s = 3.0 + seconds(IssuerLimit::kForgetAfter);
  EXPECT_TRUE(limit.note("new", at(later_s)));
}

TEST(IssuerLimit, AClockThatIsSetBackRefillsNothing) {
  IssuerLimit limit;
  EXPECT_EQ(admitted(&limit, "alice", 1000, 0.0), IssuerLimit::kBurst);
  EXPECT_EQ(admitted(&limit, "alice", 1000, -500.0), 0);
  EXPECT_EQ(admitted(&limit, "alice", 1000, -499.0), 2);
}

}  // namespace
}  // namespace rcs::recorder
