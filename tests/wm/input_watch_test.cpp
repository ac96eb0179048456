// Silence is measured in node time, relative to the period of its source.
#include "modules/wm/input_watch.h"

#include <gtest/gtest.h>

namespace rcs::wm {
namespace {

constexpr Stamp at(double s) { return Stamp(from_seconds(s)); }

// Sensor time is another clock: 1000 s ahead of the node's here.
void receive(InputWatch* watch, Input input, double from_s, double to_s, double period_s) {
  for (double t = from_s; t <= to_s; t += period_s) watch->add(input, at(1000.0 + t), at(t));
}

TEST(InputWatch, NothingReceivedIsNotSilence) {
  const InputWatch watch;
  EXPECT_LT(watch.silence(Input::kIns, at(5.0)), Duration::zero());
  EXPECT_FALSE(watch.silent(Input::kIns, at(5.0)));
  EXPECT_LE(watch.all_silent_for(at(5.0)), Duration::zero());
}

TEST(InputWatch, ThreePeriodsAndAtLeast200Milliseconds) {
  InputWatch watch;
  receive(&watch, Input::kIns, 0.0, 10.0, 0.01);
  receive(&watch, Input::kGps, 0.0, 10.0, 1.0);
  EXPECT_EQ(watch.limit(Input::kIns), from_milliseconds(200.0));
  EXPECT_NEAR(seconds(watch.limit(Input::kGps)), 3.0, 0.01);
  EXPECT_FALSE(watch.silent(Input::kIns, at(10.15)));
  EXPECT_TRUE(watch.silent(Input::kIns, at(10.25)));
  EXPECT_FALSE(watch.silent(Input::kGps, at(12.9)));
  EXPECT_TRUE(watch.silent(Input::kGps, at(13.2)));
}

TEST(InputWatch, AllAreSilentAsSoonAsTheFastestSourceWouldHaveBeenMissed) {
  InputWatch watch;
  receive(&watch, Input::kIns, 0.0, 10.0, 0.01);
  receive(&watch, Input::kLadar, 0.0, 10.0, 0.1);
  receive(&watch, Input::kGps, 0.0, 10.0, 1.0);
  EXPECT_LE(watch.all_silent_for(at(10.19)), Duration::zero());
  EXPECT_GT(watch.all_silent_for(at(10.22)), Duration::zero());
  // One source alone is an input, and has its own limit.
  receive(&watch, Input::kLadar, 10.4, 20.0, 0.1);
  EXPECT_TRUE(watch.silent(Input::kIns, at(20.0)));
  EXPECT_LE(watch.all_silent_for(at(20.15)), Duration::zero());
  EXPECT_GT(watch.all_silent_for(at(20.45)), Duration::zero());
}

TEST(InputWatch, WheelsAloneAreASilence) {
  InputWatch watch;
  receive(&watch, Input::kIns, 0.0, 10.0, 0.01);
  receive(&watch, Input::kOdometry, 0.0, 20.0, 0.05);
  EXPECT_FALSE(watch.silent(Input::kOdometry, at(20.0)));
  EXPECT_LE(watch.all_silent_for(at(10.19)), Duration::zero());
  EXPECT_GT(watch.all_silent_for(at(10.22)), Duration::zero());
}

TEST(InputWatch, AGapIsNotMistakenForAPeriod) {
  InputWatch watch;
  receive(&watch, Input::kIns, 0.0, 10.0, 0.01);
  receive(&watch, Input::kIns, 40.0, 40.5, 0.01);
  EXPECT_TRUE(watch.silent(Input::kIns, at(40.8)));
}

}  // namespace
}  // namespace rcs::wm
