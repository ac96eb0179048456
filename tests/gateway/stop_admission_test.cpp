#include "modules/gateway/stop_admission.h"

#include <gtest/gtest.h>

#include <string>

namespace rcs::gateway {
namespace {

using Verdict = StopAdmission::Verdict;
constexpr std::uint64_t kAlice = 11, kMallory = 12, kUnknown = 13;
constexpr int kMax = static_cast<int>(StopAdmission::kMaxOthers);

StopAdmission of_two_writers() {
  StopAdmission admission("demo3");
  admission.set_writers({{kAlice, "alice"}, {kMallory, "mallory"}});
  return admission;
}

TEST(StopAdmission, AWriterSpeaksForItsOwnOperatorOnly) {
  StopAdmission admission = of_two_writers();
  EXPECT_EQ(admission.judge({"demo3", "alice", kAlice, true}), Verdict::kStored);
  EXPECT_EQ(admission.judge({"demo3", "alice", kAlice, false}), Verdict::kStored);
  EXPECT_FALSE(admission.take_refused_release());
  // It would displace samples of Alice that have not been read.
  EXPECT_EQ(admission.judge({"demo3", "alice", kMallory, false}), Verdict::kDropped);
  EXPECT_TRUE(admission.take_refused_release());
  EXPECT_FALSE(admission.take_unnamed_stop());
  EXPECT_EQ(admission.judge({"demo3", "alice", kMallory, true}), Verdict::kUnnamedStop);
  EXPECT_TRUE(admission.take_unnamed_stop());
  EXPECT_FALSE(admission.take_unnamed_stop());
  EXPECT_EQ(admission.not_stored(), 2);
}

TEST(StopAdmission, SamplesForOtherVehiclesAreNotStored) {
  StopAdmission admission = of_two_writers();
  for (const bool engage : {true, false}) {
    EXPECT_EQ(admission.judge({"demo4", "alice", kAlice, engage}), Verdict::kDropped);
    EXPECT_EQ(admission.judge({"demo4", "alice", kUnknown, engage}), Verdict::kDropped);
  }
  EXPECT_FALSE(admission.take_unnamed_stop());
}

TEST(StopAdmission, AWriterThatInventsOperatorsIsBoundedAndItsStopsCount) {
  StopAdmission admission = of_two_writers();
  int stored = 0;
  for (int k = 0; k < 10'000; ++k) {
    const std::string name = "invented" + std::to_string(k);
    EXPECT_EQ(admission.judge({"demo3", name, kMallory, false}), Verdict::kDropped);
    if (admission.judge({"demo3", name, kUnknown, false}) == Verdict::kStored) ++stored;
  }
  EXPECT_EQ(stored, kMax) << "its discovery may not have ended";
  EXPECT_EQ(admission.judge({"demo3", "invented5", kUnknown, false}), Verdict::kStored);
  EXPECT_EQ(admission.judge({"demo3", "invented", kUnknown, true}), Verdict::kUnnamedStop);
  EXPECT_EQ(admission.judge({"demo3", "alice", kAlice, true}), Verdict::kStored);
  admission.set_writers({{kUnknown, "bob"}});
  EXPECT_EQ(admission.judge({"demo3", "bob", kUnknown, false}), Verdict::kStored);
}

TEST(StopAdmission, TheOperatorOfAWriterThatHasEndedIsKnown) {
  StopAdmission admission = of_two_writers();
  admission.set_writers({});
  ASSERT_NE(admission.operator_of(kAlice), nullptr);
  EXPECT_EQ(*admission.operator_of(kAlice), "alice");
  EXPECT_EQ(admission.operator_of(kUnknown), nullptr);
  for (std::uint64_t k = 100; k < 3000; ++k) admission.set_writers({{k, "x"}});
  EXPECT_EQ(admission.operator_of(kAlice), nullptr) << "their number is bounded";
  EXPECT_NE(admission.operator_of(2999), nullptr);
}

}  // namespace
}  // namespace rcs::gateway
