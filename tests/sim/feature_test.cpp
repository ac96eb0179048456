#include "sim/terrain/feature.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/vehicle/contact.h"

namespace rcs::sim {
namespace {

Feature feature(Feature::Kind kind, double height_m, double width_m) {
  Feature f;
  f.kind = kind;
  f.a_world = {20.0, -30.0};
  f.b_world = {20.0, 30.0};  // north: its left is west
  f.height_m = height_m;
  f.width_m = width_m;
  return f;
}

TEST(Feature, HeightsAcrossTheLine) {
  const std::vector<Feature> drop = {feature(Feature::Kind::kStep, -2.0, 0.2)};
  EXPECT_EQ(feature_height(drop, 21.0, 0.0), 0.0) << "right of the line";
  EXPECT_NEAR(feature_height(drop, 19.9, 0.0), -1.0, 1e-9);
  EXPECT_NEAR(feature_height(drop, 18.0, 0.0), -2.0, 1e-9);
  EXPECT_NEAR(feature_height(drop, 18.0, 40.0), 0.0, 1e-9) << "beyond its end";
  EXPECT_NEAR(feature_height(drop, -20.0, 0.0), 0.0, 1e-9) << "it returns";
  const std::vector<Feature> ditch = {feature(Feature::Kind::kDitch, 1.0, 2.0)};
  EXPECT_NEAR(feature_height(ditch, 20.0, 0.0), -1.0, 1e-9);
  EXPECT_NEAR(feature_height(ditch, 21.1, 0.0), 0.0, 1e-9);
  const std::vector<Feature> wall = {feature(Feature::Kind::kWall, 1.5, 0.4)};
  EXPECT_NEAR(feature_height(wall, 20.1, 0.0), 1.5, 1e-9);
  EXPECT_NEAR(feature_height(wall, 20.3, 0.0), 0.0, 1e-9);
}

TEST(Feature, HazardsLieAcrossTheLegsAndFollowTheSeed) {
  HazardParams params;
  params.kinds = {"drop", "ditch", "wall"};
  const std::vector<Vec2> course = {{0.0, 0.0}, {70.0, 0.0}, {70.0, 10.0}, {70.0, 90.0}};
  const std::vector<Feature> first = draw_hazards(params, course, 1);
  ASSERT_EQ(first.size(), 2U) << "none on the leg of 10 m";
  EXPECT_NE(first[0].a_world, draw_hazards(params, course, 2)[0].a_world);
  EXPECT_EQ(first[0].a_world, draw_hazards(params, course, 1)[0].a_world);
  // The leg crosses the line.
  EXPECT_LT(first[0].a_world.y() * first[0].b_world.y(), 0.0);
  EXPECT_TRUE(draw_hazards({}, course, 1).empty());
  EXPECT_EQ(unknown_hazard({"drop", "lake"}), "lake");
}

TEST(Contact, OfTheVehicleWithFeatures) {
  const auto at = [](const Feature& f, double x_m) {
    WorldParams params;
    params.features = {f};
    const World world(params, {}, {{0.0, 0.0}, {40.0, 0.0}}, 60.0);
    const CoursePoint place{{x_m, 0.0}, kPi};  // it faces west, towards the feature
    const Pose T{exp_so3(Vec3(0.0, 0.0, kPi)), Vec3(x_m, 0.0, 0.9)};
    return contact(world, place, T, VehicleParams{}, Footprint{}, PassableLimits{});
  };
  const Feature drop = feature(Feature::Kind::kStep, -1.0, 0.2);
  EXPECT_FALSE(at(drop, 24.0).any());
  EXPECT_TRUE(at(drop, 21.2).edge) << "the front wheels are at the edge";
  const Feature low = feature(Feature::Kind::kStep, -0.25, 0.2);
  for (double x_m = 18.0; x_m < 24.0; x_m += 0.1) EXPECT_FALSE(at(low, x_m).any()) << x_m;
  EXPECT_TRUE(at(feature(Feature::Kind::kWall, 1.0, 0.4), 21.6).body) << "against the bumper";
  EXPECT_FALSE(at(feature(Feature::Kind::kWall, 1.0, 0.4), 23.0).any());
  EXPECT_TRUE(at(feature(Feature::Kind::kDitch, 1.0, 1.5), 21.9).edge);
  // A gentle slope of 20 deg is passable.
  const Feature ramp = feature(Feature::Kind::kStep, 2.0, 5.5);
  for (double x_m = 12.0; x_m < 24.0; x_m += 0.2) EXPECT_FALSE(at(ramp, x_m).any()) << x_m;
}

TEST(Contact, ATiltedBodyIsTipped) {
  const World world(WorldParams{}, {}, {{0.0, 0.0}}, 60.0);
  const Pose T{exp_so3(Vec3(radians(31.0), 0.0, 0.0)), Vec3(0.0, 0.0, 0.9)};
  EXPECT_TRUE(contact(world, {}, T, VehicleParams{}, Footprint{}, PassableLimits{}).tipped);
}

}  // namespace
}  // namespace rcs::sim
