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

void decide_clock(StampWatch* watch) { watch->decide(true); }
void decide_latency(StampWatch* watch) { watch->decide(false); }

TEST(StampWatch, AChangeIsUndecidedUntilARegistrationDecides) {
  for (const double step_s : {-0.4, 0.4}) {
    const auto stepped = [step_s](double t) { return fault(t, {step_s, 0.05, 0.0}); };
    EXPECT_FALSE(run(stepped).shift()) << step_s;
    EXPECT_EQ(run(stepped, decide_clock).shift(), from_seconds(-step_s));
    EXPECT_EQ(run(stepped, decide_latency).shift(), Duration::zero()) << step_s;
  }
}

TEST(StampWatch, ASmallerLatencyIsTheUsualOneFromThenOn) {
  // The computer was busy when SP began. Later the stamps step by as much as the latency before.
  const StampWatch watch = run(
      [](double t) {
        return At{t < 15.0 ? 0.0 : -0.2, t < 5.0 ? 0.25 : 0.05, 0.0};
      },
      decide_latency);
  EXPECT_EQ(watch.changed(), from_seconds(-0.2));
}

TEST(StampWatch, ADelayLooksLikeAnOldStamp) {
  const StampWatch watch = run([](double t) { return fault(t, {0.0, 0.35, 0.0}); });
  EXPECT_EQ(watch.changed(), from_seconds(-0.3));
}

TEST(StampWatch, AStepThatReturnsIsForgotten) {
  const StampWatch watch =
      run([](double t) { return t < 10.0 || t > 15.0 ? At{} : At{-0.4}; }, decide_clock);
  EXPECT_EQ(watch.shift(), Duration::zero());
}

TEST(StampWatch, ACorrectionLastsWhileTheInsIsSilent) {
  // From 15 s on the newest INS sample is that of 15 s.
  const StampWatch watch = run(
      [](double t) {
        return At{t < 10.0 ? 0.0 : 0.4, 0.05, t < 15.0 ? 0.0 : 15.0 - t};
      },
      decide_clock);
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
