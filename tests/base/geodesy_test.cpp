#include "rcs/base/geodesy.h"

#include <gtest/gtest.h>

#include <limits>

namespace rcs {
namespace {

const Geodetic kDatum{radians(40.43), radians(-76.57), {150.0}};

TEST(Geodesy, DatumIsTheOrigin) { EXPECT_LT(LocalFrame(kDatum).to_world(kDatum).norm(), 1e-9); }

TEST(Geodesy, RoundTripIsExact) {
  const LocalFrame frame(kDatum);
  const Vec3 p(1234.5, -876.5, 54.3);
  EXPECT_LT((frame.to_world(frame.to_geodetic(p)) - p).norm(), 1e-7);
}

TEST(Geodesy, AxesAreEastNorthUp) {
  const LocalFrame frame(kDatum);
  Geodetic g = kDatum;
  g.lon_rad += radians(0.001);
  EXPECT_NEAR(frame.to_world(g).x(), 84.8, 0.2);  // 111.32 km per degree times cos(40.43 deg)
  g = kDatum;
  g.lat_rad += radians(0.001);
  EXPECT_NEAR(frame.to_world(g).y(), 111.04, 0.1);
  g = kDatum;
  g.height.m += 7.0;
  EXPECT_NEAR(frame.to_world(g).z(), 7.0, 1e-9);
}

TEST(Geodesy, FramesOfTwoDatumsAgreeOnAPosition) {
  const LocalFrame a(kDatum);
  const LocalFrame b({kDatum.lat_rad + 0.001, kDatum.lon_rad - 0.002, {20.0}});
  const Vec3 p_b(321.0, -45.0, 6.0);
  EXPECT_LT((a.from(b) * p_b - a.to_world(b.to_geodetic(p_b))).norm(), 1e-6);
}

TEST(Geodesy, HeightsConvertByTheUndulation) {
  const OrthometricHeight h = to_orthometric(EllipsoidalHeight{100.0}, Undulation{-33.0});
  EXPECT_DOUBLE_EQ(h.m, 133.0);
  EXPECT_DOUBLE_EQ(to_ellipsoidal(h, Undulation{-33.0}).m, 100.0);
}

TEST(Geodesy, ImplausibleCoordinatesAreRejected) {
  EXPECT_TRUE(plausible(kDatum));
  EXPECT_FALSE(plausible({2.0, 0.0, {0.0}}));
  EXPECT_FALSE(plausible({std::numeric_limits<double>::quiet_NaN(), 0.0, {0.0}}));
  EXPECT_FALSE(plausible({0.0, 0.0, {std::numeric_limits<double>::infinity()}}));
}

TEST(Geodesy, GravityAndEarthRateHaveTheirPublishedValues) {
  EXPECT_NEAR(normal_gravity(0.0, {0.0}), 9.7803253359, 1e-9);      // WGS84, equator
  EXPECT_NEAR(normal_gravity(kPi / 2, {0.0}), 9.8321849378, 1e-9);  // WGS84, pole
  EXPECT_NEAR(earth_rate_world(0.5).norm(), 7.292115e-5, 1e-12);
}

}  // namespace
}  // namespace rcs
