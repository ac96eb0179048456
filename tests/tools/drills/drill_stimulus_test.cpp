// Effects of each kind of stimulus on the messages.

#include <gmock/gmock.h>

#include <cmath>

#include "tests/tools/drills/drill_fixture.h"

namespace rcs::test {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

drills::Stimulus from_5_to_10(drills::StimulusKind kind, drills::DrillSource source) {
  drills::Stimulus s;
  s.kind = kind;
  s.source = source;
  s.begin_s = 5.0;
  s.length_s = 5.0;
  return s;
}
drills::Stimulus gps(drills::StimulusKind kind) {
  return from_5_to_10(kind, drills::DrillSource::kGps);
}

bool inside(const Arrived& a) { return time_s(a.due) >= 5.0 && time_s(a.due) < 10.0; }

/// East, north, up of a fix from the datum.
Vec3 place_of(const gps_fix_t& fix) {
  return LocalFrame(datum()).to_world({radians(fix.lat_deg), radians(fix.lon_deg), {fix.height_m}});
}

/// Fixes within the window satisfy `changed`, all others and all other messages are unchanged.
template <class Check>
void expect_only_fixes_inside(const drills::Stimulus& s, Check check) {
  const std::vector<Arrived> quiet = stimulated({});
  const std::vector<Arrived> drilled = stimulated({s});
  ASSERT_EQ(quiet.size(), drilled.size());
  int changed = 0;
  for (std::size_t i = 0; i < quiet.size(); ++i) {
    if (quiet[i].channel != channel::kGpsFix || !inside(quiet[i])) {
      EXPECT_EQ(quiet[i], drilled[i]) << i;
      continue;
    }
    ++changed;
    check(quiet[i].as<gps_fix_t>(), drilled[i].as<gps_fix_t>());
  }
  EXPECT_EQ(changed, 10);
}

TEST(DrillStimulus, WithoutAStimulusNothingChanges) { EXPECT_EQ(stimulated({}), quiet_drive()); }

TEST(DrillStimulus, TheSameSeedGivesTheSameMessages) {
  drills::Stimulus empty =
      from_5_to_10(drills::StimulusKind::kEmptyFacets, drills::DrillSource::kLadar);
  empty.share = 0.5;
  EXPECT_EQ(stimulated({empty}, 7), stimulated({empty}, 7));
  EXPECT_NE(stimulated({empty}, 7), stimulated({empty}, 8));
}

TEST(DrillStimulus, ADropoutRemovesItsSourceOnly) {
  const std::vector<Arrived> quiet = stimulated({});
  for (const drills::DrillSource source : {drills::DrillSource::kGps, drills::DrillSource::kLadar,
                                           drills::DrillSource::kIns, drills::DrillSource::kAll}) {
    const std::vector<Arrived> left =
        stimulated({from_5_to_10(drills::StimulusKind::kDropout, source)});
    std::vector<Arrived> expected;
    for (const Arrived& a : quiet) {
      if (!inside(a) || !drills::publishes_on(source, a.channel)) expected.push_back(a);
    }
    EXPECT_LT(left.size(), quiet.size());
    EXPECT_EQ(left, expected);
  }
}

TEST(DrillStimulus, TheTruthIsNeverTouched) {
  std::vector<Arrived> events;
  for (int k = 0; k < 20; ++k) {
    append(kBegin + std::chrono::seconds(k), channel::kIns, ins_t{}, &events);
    append(kBegin + std::chrono::seconds(k), channel::kSimTruth, ins_t{}, &events);
  }
  Script script(events);
  drills::StimulatedSource source(
      &script, {from_5_to_10(drills::StimulusKind::kDropout, drills::DrillSource::kAll)}, 1);
  const std::vector<Arrived> left = drain(&source);
  EXPECT_THAT(of_channel(left, channel::kSimTruth), SizeIs(20));
  EXPECT_THAT(of_channel(left, channel::kIns), SizeIs(15));
}

TEST(DrillStimulus, FlappingAlternates) {
  drills::Stimulus s = gps(drills::StimulusKind::kFlapping);
  s.on_s = 1.0;
  s.off_s = 1.5;
  s.count = 2;
  std::vector<double> times;
  for (const Arrived& a : of_channel(stimulated({s}), channel::kGpsFix)) {
    if (inside(a)) times.push_back(time_s(a.due));
  }
  EXPECT_THAT(times, ElementsAre(5.0, 5.5, 7.5, 8.0));
}

TEST(DrillStimulus, AnOffsetHasItsDistanceAndDirection) {
  drills::Stimulus s = gps(drills::StimulusKind::kOffset);
  s.offset_m = 110.0;
  s.bearing_rad = radians(90.0);  // east
  expect_only_fixes_inside(s, [](const gps_fix_t&, const gps_fix_t& fix) {
    EXPECT_NEAR((place_of(fix) - Vec3(110.0, 0.0, 0.0)).norm(), 0.0, 0.01);
    EXPECT_EQ(fix.v_enu_mps[0], 0.0);
  });
}

TEST(DrillStimulus, AnOffsetMayBeOfOneFixAndMayDecay) {
  drills::Stimulus one = gps(drills::StimulusKind::kOffset);
  one.offset_m = 5.0;
  one.count = 1;
  int off = 0;
  for (const Arrived& a : of_channel(stimulated({one}), channel::kGpsFix)) {
    off += place_of(a.as<gps_fix_t>()).norm() > 1.0 ? 1 : 0;
  }
  EXPECT_EQ(off, 1);

  drills::Stimulus settling = gps(drills::StimulusKind::kOffset);
  settling.offset_m = 4.0;
  settling.decay_s = 4.0;
  double since_s = 0.0;
  expect_only_fixes_inside(settling, [&](const gps_fix_t&, const gps_fix_t& fix) {
    EXPECT_NEAR(place_of(fix).y(), std::max(0.0, 4.0 - since_s), 0.01);
    since_s += 0.5;
  });
}

TEST(DrillStimulus, ARampGrowsWithOrWithoutAMatchingVelocity) {
  for (const bool with_velocity : {true, false}) {
    drills::Stimulus s = gps(drills::StimulusKind::kRamp);
    s.rate_mps = 2.0;
    s.bearing_rad = radians(180.0);
    s.with_velocity = with_velocity;
    double since_s = 0.0;
    expect_only_fixes_inside(s, [&](const gps_fix_t&, const gps_fix_t& fix) {
      EXPECT_NEAR((place_of(fix) - Vec3(0.0, -2.0 * since_s, 0.0)).norm(), 0.0, 0.01);
      EXPECT_NEAR(fix.v_enu_mps[1], with_velocity ? -2.0 : 0.0, 1e-12);
      since_s += 0.5;
    });
  }
}

TEST(DrillStimulus, HeightSigmaNullIslandAndNonFiniteStimuli) {
  drills::Stimulus s = gps(drills::StimulusKind::kHeight);
  s.height_m = -33.0;
  expect_only_fixes_inside(s, [](const gps_fix_t& before, const gps_fix_t& fix) {
    EXPECT_EQ(fix.height_m, before.height_m - 33.0);
    EXPECT_EQ(fix.lat_deg, before.lat_deg);
  });
  s = gps(drills::StimulusKind::kSigma);
  s.sigma_m = 0.02;
  expect_only_fixes_inside(s, [](const gps_fix_t& before, const gps_fix_t& fix) {
    for (const double sigma_m : fix.sigma_enu_m) EXPECT_EQ(sigma_m, 0.02);
    EXPECT_EQ(fix.lat_deg, before.lat_deg);
  });
  expect_only_fixes_inside(gps(drills::StimulusKind::kNullIsland),
                           [](const gps_fix_t&, const gps_fix_t& fix) {
                             EXPECT_EQ(fix.lat_deg, 0.0);
                             EXPECT_EQ(fix.lon_deg, 0.0);
                           });
  expect_only_fixes_inside(
      gps(drills::StimulusKind::kNan), [](const gps_fix_t&, const gps_fix_t& fix) {
        EXPECT_TRUE(std::isnan(fix.lat_deg) && std::isnan(fix.lon_deg) && std::isnan(fix.height_m));
      });
}

TEST(DrillStimulus, AFrozenFixHasNewStampsAndAStaleOneOldStamps) {
  // A value that changes from fix to fix.
  drills::Stimulus walk = gps(drills::StimulusKind::kRamp);
  walk.begin_s = 0.0;
  walk.length_s = 20.0;
  walk.rate_mps = 1.0;
  const std::vector<Arrived> walking = of_channel(stimulated({walk}), channel::kGpsFix);
  const std::vector<Arrived> frozen =
      of_channel(stimulated({walk, gps(drills::StimulusKind::kFrozen)}), channel::kGpsFix);
  ASSERT_EQ(walking.size(), frozen.size());
  for (std::size_t i = 0; i < frozen.size(); ++i) {
    const auto now = walking[i].as<gps_fix_t>();
    const auto fix = frozen[i].as<gps_fix_t>();
    EXPECT_EQ(fix.utime, now.utime);
    EXPECT_EQ(fix.seq, now.seq);
    EXPECT_NEAR(place_of(fix).y(), inside(frozen[i]) ? 5.0 : time_s(frozen[i].due), 0.01);
  }

  drills::Stimulus stale = gps(drills::StimulusKind::kStale);
  stale.age_s = 3.0;
  expect_only_fixes_inside(stale, [](const gps_fix_t& before, const gps_fix_t& fix) {
    EXPECT_EQ(fix.utime, before.utime - 3'000'000);
    EXPECT_EQ(fix.lat_deg, before.lat_deg);
  });
}

TEST(DrillStimulus, AShareOfTheFacetsIsEmpty) {
  for (const double share : {0.0, 0.25, 1.0}) {
    drills::Stimulus s =
        from_5_to_10(drills::StimulusKind::kEmptyFacets, drills::DrillSource::kLadar);
    s.length_s = 15.0;
    s.share = share;
    int empty = 0;
    int all = 0;
    for (const Arrived& a : stimulated({s})) {
      if (!drills::publishes_on(drills::DrillSource::kLadar, a.channel)) continue;
      const bool ranges = a.channel == channel::kLadarRanges;
      const int n = ranges ? a.as<ladar_ranges_t>().n : a.as<ladar_points_t>().n;
      if (time_s(a.due) < 5.0) {
        EXPECT_EQ(n, 100);
        continue;
      }
      ++all;
      empty += n == 0 ? 1 : 0;
    }
    EXPECT_EQ(all, 120);
    EXPECT_NEAR(empty, share * all, 4.0 * std::sqrt(share * (1.0 - share) * all));
  }
}

TEST(DrillStimulus, DustIsNearAndOnlyInFrontOfFartherReturns) {
  drills::Stimulus s = from_5_to_10(drills::StimulusKind::kDust, drills::DrillSource::kLadar);
  s.share = 0.3;
  int dusty = 0;
  int all = 0;
  for (const Arrived& a : stimulated({s})) {
    if (!inside(a) || !drills::publishes_on(drills::DrillSource::kLadar, a.channel)) continue;
    std::vector<float> range_m;
    if (a.channel == channel::kLadarRanges) {
      range_m = a.as<ladar_ranges_t>().range_m;
    } else {
      const auto m = a.as<ladar_points_t>();
      for (std::size_t i = 0; i < m.x_m.size(); ++i) {
        range_m.push_back(std::hypot(m.x_m[i], m.y_m[i], m.z_m[i]));
        EXPECT_NEAR(m.y_m[i] / m.x_m[i], 8.0 / 6.0, 1e-5) << "along its own ray";
      }
    }
    for (const float r : range_m) {
      ++all;
      dusty += r < 9.99F ? 1 : 0;
      EXPECT_TRUE(std::abs(r - 10.0F) < 1e-4F || (r >= 2.0F && r <= 6.001F)) << r;
    }
  }
  EXPECT_NEAR(dusty, 0.3 * all, 4.0 * std::sqrt(0.21 * all));
}

TEST(DrillStimulus, AClockJumpMovesStampsAndNotArrivals) {
  drills::Stimulus s = from_5_to_10(drills::StimulusKind::kClock, drills::DrillSource::kAll);
  s.jump_s = -10.0;
  const std::vector<Arrived> quiet = stimulated({});
  const std::vector<Arrived> drilled = stimulated({s});
  ASSERT_EQ(quiet.size(), drilled.size());
  for (std::size_t i = 0; i < quiet.size(); ++i) {
    const std::int64_t moved = inside(quiet[i]) ? -10'000'000 : 0;
    EXPECT_EQ(drilled[i].due, quiet[i].due);
    if (quiet[i].channel == channel::kIns) {
      EXPECT_EQ(drilled[i].as<ins_t>().utime, quiet[i].as<ins_t>().utime + moved);
    }
    if (quiet[i].channel == channel::kLadarRanges) {
      const auto before = quiet[i].as<ladar_ranges_t>();
      const auto after = drilled[i].as<ladar_ranges_t>();
      EXPECT_EQ(after.utime, before.utime + moved);
      EXPECT_EQ(after.reference_utime, before.reference_utime + moved);
    }
  }
}

TEST(DrillStimulus, DelayedMessagesArriveLaterInOrder) {
  drills::Stimulus s = gps(drills::StimulusKind::kDelay);
  s.delay_ms = 230.0;
  const std::vector<Arrived> drilled = stimulated({s});
  EXPECT_THAT(drilled, SizeIs(stimulated({}).size()));
  for (std::size_t i = 1; i < drilled.size(); ++i) EXPECT_LE(drilled[i - 1].due, drilled[i].due);
  int late = 0;
  for (const Arrived& a : of_channel(drilled, channel::kGpsFix)) {
    const Duration age = a.due - from_utime(a.as<gps_fix_t>().utime);
    late += age == std::chrono::milliseconds(230) ? 1 : 0;
    EXPECT_TRUE(age == Duration(0) || age == std::chrono::milliseconds(230));
  }
  EXPECT_EQ(late, 10);
}

TEST(DrillStimulus, DisorderSwapsAndRepetitionDoubles) {
  const auto seqs = [](const std::vector<Arrived>& all) {
    std::vector<std::int64_t> out;
    for (const Arrived& a : of_channel(all, channel::kGpsFix)) {
      out.push_back(a.as<gps_fix_t>().seq);
    }
    return out;
  };
  drills::Stimulus s = gps(drills::StimulusKind::kReorder);
  s.length_s = 2.0;
  std::vector<std::int64_t> expected = seqs(stimulated({}));
  std::swap(expected[10], expected[11]);
  std::swap(expected[12], expected[13]);
  EXPECT_EQ(seqs(stimulated({s})), expected);

  // A message that is still delayed when the drive ends is not lost.
  s.begin_s = 19.4;
  EXPECT_THAT(stimulated({s}), SizeIs(stimulated({}).size()));

  drills::Stimulus twice = gps(drills::StimulusKind::kRepeat);
  twice.length_s = 1.0;
  twice.delay_ms = 100.0;
  const std::vector<std::int64_t> doubled = seqs(stimulated({twice}));
  EXPECT_EQ(doubled.size(), expected.size() + 2);
  EXPECT_EQ(std::count(doubled.begin(), doubled.end(), 11), 2);
  EXPECT_EQ(std::count(doubled.begin(), doubled.end(), 12), 2);
}

/// The increments of the INS within the window.
std::vector<ins_t> ins_inside(const drills::Stimulus& s) {
  // Every increment is (1, 2, 3) x 0.01.
  std::vector<Arrived> events = quiet_drive();
  for (Arrived& a : events) {
    if (a.channel != channel::kIns) continue;
    auto m = a.as<ins_t>();
    m.interval_us = 100'000;
    for (int i = 0; i < 3; ++i) m.delta_angle_rad[i] = m.delta_v_mps[i] = 0.01 * (i + 1);
    std::vector<Arrived> one;
    append(a.due, channel::kIns, m, &one);
    a = one.front();
  }
  Script script(events);
  drills::StimulatedSource source(&script, {s}, 1);
  std::vector<ins_t> inside_window;
  for (const Arrived& a : drain(&source)) {
    if (a.channel == channel::kIns && inside(a)) inside_window.push_back(a.as<ins_t>());
  }
  return inside_window;
}

TEST(DrillStimulus, AnInsMayHaveABiasThatRises) {
  drills::Stimulus s = from_5_to_10(drills::StimulusKind::kBias, drills::DrillSource::kIns);
  s.gyro_radps = Vec3(0.0, 0.0, 0.1);
  s.accel_mps2 = Vec3(1.0, 0.0, 0.0);
  s.rise_s = 2.0;
  const std::vector<ins_t> found = ins_inside(s);
  ASSERT_THAT(found, SizeIs(50));
  EXPECT_NEAR(found[0].delta_angle_rad[2], 0.03, 1e-12);
  EXPECT_NEAR(found[10].delta_angle_rad[2], 0.03 + 0.5 * 0.1 * 0.1, 1e-12);
  EXPECT_NEAR(found[40].delta_angle_rad[2], 0.03 + 0.1 * 0.1, 1e-12);
  EXPECT_NEAR(found[40].delta_v_mps[0], 0.01 + 0.1, 1e-12);
}

TEST(DrillStimulus, AnInsMayBeScaledZeroSaturatedOrHaveWrongAxes) {
  drills::Stimulus s = from_5_to_10(drills::StimulusKind::kScale, drills::DrillSource::kIns);
  s.gyro_factor = 2.0;
  EXPECT_NEAR(ins_inside(s)[3].delta_angle_rad[1], 0.04, 1e-12);
  EXPECT_NEAR(ins_inside(s)[3].delta_v_mps[1], 0.02, 1e-12);
  s.kind = drills::StimulusKind::kZero;
  EXPECT_EQ(ins_inside(s)[3].delta_v_mps[1], 0.0);
  s.kind = drills::StimulusKind::kSaturate;
  s.gyro_radps = s.accel_mps2 = Vec3(0.05, 0.05, 0.05);
  EXPECT_NEAR(ins_inside(s)[3].delta_angle_rad[2], 0.005, 1e-12);
  s.kind = drills::StimulusKind::kAxes;
  s.axes = {-2, 1, 3};
  EXPECT_NEAR(ins_inside(s)[3].delta_angle_rad[0], -0.02, 1e-12);
  EXPECT_NEAR(ins_inside(s)[3].delta_angle_rad[1], 0.01, 1e-12);
}

TEST(DrillStimulus, ALadarMayBeScaledAndItsMountTurned) {
  drills::Stimulus s = from_5_to_10(drills::StimulusKind::kScale, drills::DrillSource::kLadar);
  s.factor = 1.1;
  for (const Arrived& a : of_channel(stimulated({s}), channel::kLadarRanges)) {
    EXPECT_NEAR(a.as<ladar_ranges_t>().range_m.front(), inside(a) ? 11.0 : 10.0, 1e-5);
  }
  s.kind = drills::StimulusKind::kMount;
  s.pan_rad = radians(90.0);
  for (const Arrived& a : of_channel(stimulated({s}), channel::kLadarPoints)) {
    // A mount that is turned to the left shows an object ahead on the right.
    const auto m = a.as<ladar_points_t>();
    EXPECT_NEAR(m.x_m.front(), inside(a) ? 8.0 : 6.0, 1e-5);
    EXPECT_NEAR(m.y_m.front(), inside(a) ? -6.0 : 8.0, 1e-5);
  }
}

}  // namespace
}  // namespace rcs::test
