#include "modules/gateway/stop_admission.h"

#include <gtest/gtest.h>

#include <string>

namespace rcs::gateway {
namespace {

using Verdict = StopAdmission::Verdict;

TEST(StopAdmission, AWriterThatInventsOperatorsIsBoundedAndItsStopsCount) {
  StopAdmission admission;
  admission.set_writers({"alice", "mallory"});
  int stored = 0;
  for (int k = 0; k < 10'000; ++k) {
    if (admission.judge("invented" + std::to_string(k), false) == Verdict::kStored) ++stored;
  }
  EXPECT_EQ(stored, static_cast<int>(StopAdmission::kMaxOthers));
  EXPECT_EQ(admission.not_stored(), 10'000 - stored);
  EXPECT_FALSE(admission.take_unnamed_stop()) << "releases alone";
  EXPECT_EQ(admission.judge("invented", true), Verdict::kUnnamedStop);
  EXPECT_TRUE(admission.take_unnamed_stop());
  EXPECT_FALSE(admission.take_unnamed_stop());
  // Operators of writers, and those that were known before, are not affected.
  EXPECT_EQ(admission.judge("alice", true), Verdict::kStored);
  EXPECT_EQ(admission.judge("alice", false), Verdict::kStored);
  EXPECT_EQ(admission.judge("invented5", false), Verdict::kStored);
  admission.set_writers({"bob"});
  EXPECT_EQ(admission.judge("bob", false), Verdict::kStored);
}

}  // namespace
}  // namespace rcs::gateway
