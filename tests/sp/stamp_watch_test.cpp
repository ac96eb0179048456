// Stamps of scans that step, scans that are late, and steps of all clocks.
#include "modules/sp/scan/stamp_watch.h"

#include <gtest/gtest.h>

#include <functional>

namespace rcs::sp {
namespace {

struct At {
  double scan_s = 0.0;   ///< error of the stamp of a scan
  double late_s = 0.05;  ///< its latency
  double ins_s = 0.0;    ///< error of the stamp of the newest INS sample
};

/// 10 scans a second for 20 s; the fault begins after 10 s.
/// @return the watch after the last scan
StampWatch run(
    const std::function<At(double t_s)>& at,
    const std::function<void(StampWatch*)>& on_undecided = [](StampWatch*) {}) {
  StampWatch watch;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.1 * i;
    const At now = at(t);
    const double arrival = 700.0 + t + now.late_s;
    watch.add(Stamp(from_seconds(t + now.scan_s)), Stamp(from_seconds(arrival)),
              Stamp(from_seconds(t + now.late_s + now.ins_s)));
    if (!watch.shift()) on_undecided(&watch);
  }
  return watch;
}

At fault(double t, const At& faulty) { return t < 10.0 ? At{} : faulty; }

TEST(StampWatch, UsualStampsAreNotShifted) {
  const StampWatch watch = run([](double t) {
    return At{0.0, 0.05 + (static_cast<int>(10.0 * t) % 3) * 0.02, 0.0};
  });
  EXPECT_EQ(watch.changed(), Duration::zero());
  EXPECT_EQ(watch.shift(), Duration::zero());
}

TEST(StampWatch, AStampAheadIsAStepOfItsClockForAsLongAsItLasts) {
  const StampWatch watch = run([](double t) { return fault(t, {0.4, 0.05, 0.0}); });
  EXPECT_EQ(watch.shift(), from_seconds(-0.4));
}

TEST(StampWatch, AnOldStampIsUndecidedUntilARegistrationDecides) {
  const At behind{-0.4, 0.05, 0.0};
  EXPECT_FALSE(run([&](double t) { return fault(t, behind); }).shift());
  const auto decide = [&](bool clock) {
    return run([&](double t) { return fault(t, behind); },
               [clock](StampWatch* watch) { watch->decide(clock); });
  };
  EXPECT_EQ(decide(true).shift(), from_seconds(0.4));
  EXPECT_EQ(decide(false).shift(), Duration::zero());
}

TEST(StampWatch, ADelayLooksLikeAnOldStamp) {
  const StampWatch watch = run([](double t) { return fault(t, {0.0, 0.35, 0.0}); });
  EXPECT_EQ(watch.changed(), from_seconds(-0.3));
}

TEST(StampWatch, AStepThatReturnsIsForgotten) {
  const StampWatch watch = run([](double t) { return t < 10.0 || t > 15.0 ? At{} : At{-0.4}; },
                               [](StampWatch* w) { w->decide(true); });
  EXPECT_EQ(watch.shift(), Duration::zero());
}

TEST(StampWatch, ACorrectionLastsWhileTheInsIsSilent) {
  // From 15 s on the newest INS sample is that of 15 s.
  const StampWatch watch = run([](double t) {
    return At{t < 10.0 ? 0.0 : 0.4, 0.05, t < 15.0 ? 0.0 : 15.0 - t};
  });
  EXPECT_EQ(watch.shift(), from_seconds(-0.4));
}

TEST(StampWatch, StepsOfAllClocksAndOfTheInsAloneShiftNothing) {
  for (const double step_s : {-0.4, 0.4}) {
    EXPECT_EQ(run([&](double t) {
                return fault(t, {step_s, 0.05, step_s});
              }).shift(),
              Duration::zero());
    EXPECT_EQ(run([&](double t) {
                return fault(t, {0.0, 0.05, step_s});
              }).shift(),
              Duration::zero());
  }
}

}  // namespace
}  // namespace rcs::sp
