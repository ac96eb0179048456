#include "rcs/zones/zone_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "rcs/zones/zone_params.h"
#include "tests/support/fresh_folder.h"

namespace rcs {
namespace {

constexpr const char* kSquare = "[[[-76.57,40.43],[-76.56,40.43],[-76.56,40.44],[-76.57,40.43]]]";

std::string feature(const std::string& properties, const std::string& coordinates,
                    const std::string& type = "Polygon") {
  return R"({"type":"Feature","properties":{)" + properties + R"(},"geometry":{"type":")" + type +
         R"(","coordinates":)" + coordinates + "}}";
}

std::string collection(const std::string& features) {
  return R"({"type":"FeatureCollection","features":[)" + features + "]}";
}

std::string file(const std::string& coordinates) {
  return collection(feature(R"("kind":"keep_out","name":"pond")", coordinates));
}

/// The error, which must begin with the file's name.
std::string error_of(const std::string& text) {
  const Result<GeodeticZones> zones = parse_zones(text, "a.geojson");
  if (zones) return "no error";
  const std::string begin = "a.geojson: ";
  EXPECT_EQ(zones.error().message.compare(0, begin.size(), begin), 0) << zones.error().message;
  return zones.error().message.substr(begin.size());
}

void expect_error(const std::string& text, const std::string& part) {
  const std::string found = error_of(text);
  EXPECT_NE(found.find(part), std::string::npos) << found << "\nexpected: " << part;
}

TEST(ZoneFile, ReadsPolygonsOfAllKinds) {
  const std::string text =
      collection(feature(R"("kind":"fence","name":"site","fid":3)", kSquare) + "," +
                 feature(R"("kind":"keep_out","name":"pond","speed_mps":null)",
                         std::string("[") + kSquare + "," + kSquare + "]", "MultiPolygon") +
                 "," + feature(R"("kind":"speed","name":"yard","speed_mps":1.5)", kSquare));
  const Result<GeodeticZones> zones = parse_zones(text, "a.geojson");
  ASSERT_TRUE(zones) << zones.error().message;
  ASSERT_EQ(zones->zones.size(), 3U);
  EXPECT_EQ(zones->zones[0].kind, ZoneKind::kFence);
  EXPECT_EQ(zones->zones[0].name, "site");
  EXPECT_EQ(zones->zones[1].polygons.size(), 2U);
  EXPECT_EQ(zones->zones[2].speed_mps, 1.5);
}

TEST(ZoneFile, ConvertsToFrameWorldOfAnyDatum) {
  const Result<GeodeticZones> read = parse_zones(file(kSquare), "a.geojson");
  ASSERT_TRUE(read) << read.error().message;
  const LocalFrame world({radians(40.43), radians(-76.57), {150.0}});
  const Zones zones = read->in_world(world);
  // The first vertex is the datum; inside of the triangle the clearance is negative.
  EXPECT_NEAR(zones.clearance({-3.0, -4.0}).m, 5.0, 1e-3);
  EXPECT_LT(zones.clearance({400.0, 200.0}).m, 0.0);
  // 0.01 deg further west the same zone is that much further east.
  const LocalFrame west({radians(40.43), radians(-76.58), {150.0}});
  const Vec2 moved = west.to_world({radians(40.43), radians(-76.57), {150.0}}).head<2>();
  EXPECT_NEAR(moved.x(), 848.4, 0.5);
  EXPECT_NEAR(read->in_world(west).clearance(moved + Vec2(-3.0, -4.0)).m, 5.0, 0.01);
}

// The example lies across the course of config/sim/drive.toml, whose waypoints are allowed.
TEST(ZoneFile, TheExampleMatchesTheCourseOfTheSimulator) {
  const char* const root = std::getenv("RCS_SOURCE_DIR");  // NOLINT(concurrency-mt-unsafe)
  ASSERT_NE(root, nullptr);
  const Result<GeodeticZones> read =
      load_zones(std::string(root) + "/config/zones/example.geojson");
  ASSERT_TRUE(read) << read.error().message;
  const Zones zones = read->in_world(LocalFrame({radians(40.43), radians(-76.57), {150.0}}));
  for (const Vec2& waypoint : {Vec2(0, 0), Vec2(60, 0), Vec2(120, 30), Vec2(190, 20), Vec2(250, 70),
                               Vec2(230, 150), Vec2(150, 170), Vec2(60, 140)}) {
    EXPECT_GT(zones.clearance(waypoint).m, 15.0) << waypoint.transpose();
  }
  const Zone* const pond = zones.conflict({60, 0}, {120, 30}, 0.0);
  ASSERT_NE(pond, nullptr);
  EXPECT_EQ(pond->name, "pond");
  EXPECT_EQ(zones.conflict({120, 30}, {190, 20}, 2.0), nullptr);
  EXPECT_EQ(zones.speed_limit_mps({240, 110}, 0.0), 2.0);
}

// The tangent plane of the datum would have it at the datum again.
TEST(ZoneFile, AZoneOnTheOtherSideOfTheEarthIsFarAway) {
  const Result<GeodeticZones> read = parse_zones(file(kSquare), "a.geojson");
  ASSERT_TRUE(read);
  const LocalFrame world({radians(-40.435), radians(103.435), {0.0}});
  EXPECT_GT(read->in_world(world).clearance({0.0, 0.0}).m, 1e6);
}

// An edge is straight in longitude and latitude: a parallel bends northwards in frame world.
TEST(ZoneFile, LongEdgesFollowTheParallel) {
  const Result<GeodeticZones> read = parse_zones(
      file("[[[-76.7,40.43],[-76.5,40.43],[-76.5,40.5],[-76.7,40.5],[-76.7,40.43]]]"), "a.geojson");
  ASSERT_TRUE(read) << read.error().message;
  const LocalFrame world({radians(40.43), radians(-76.6), {0.0}});
  const Zones zones = read->in_world(world);
  for (double lon_deg = -76.699; lon_deg < -76.5; lon_deg += 0.01) {
    const Vec2 p = world.to_world({radians(40.43), radians(lon_deg), {0.0}}).head<2>();
    EXPECT_NEAR(zones.clearance(p).m, 0.0, 0.03) << lon_deg;
  }
}

TEST(ZoneFile, ErrorsNameFeatureKeyAndRange) {
  expect_error("{", "is no valid JSON");
  expect_error("[]", "is no GeoJSON object");
  expect_error(R"({"type":"Feature"})", R"(type: is "Feature"; allowed is "FeatureCollection")");
  expect_error(R"({"type":"FeatureCollection"})", "features: must be an array of at least one");
  expect_error(collection(""), "features: must be an array of at least one");
  expect_error(collection("3"), "feature 1: is no object");
  expect_error(collection(R"({"type":"Point"})"), R"(feature 1: type: is "Point"; allowed is)");
  expect_error(collection(R"({"type":"Feature"})"), "feature 1: properties: is no object");
  const auto with = [](const std::string& properties) {
    return collection(feature(properties, kSquare));
  };
  expect_error(with(R"("name":"a")"), "kind: is missing; allowed are \"fence\", \"keep_out\"");
  expect_error(with(R"("kind":"lake","name":"a")"), R"(feature 1 "a": kind: is "lake"; allowed)");
  expect_error(with(R"("kind":"fence")"), "name: is missing; allowed is text of 1 to 64 bytes");
  expect_error(with(R"("kind":"fence","name":null)"), "name: is null; allowed is text");
  expect_error(with(R"("kind":"fence","name":"a\u001bb")"), "without control characters");
  expect_error(with(R"("kind":"fence","name":")" + std::string(65, 'a') + "\""), "1 to 64 bytes");
  expect_error(with(R"("kind":"speed","name":"a")"), "speed_mps: is missing; allowed is 0.1 to 30");
  expect_error(with(R"("kind":"speed","name":"a","speed_mps":0)"), "speed_mps: is 0; allowed");
  expect_error(with(R"("kind":"speed","name":"a","speed_mps":"5")"), "speed_mps: is \"5\";");
  expect_error(with(R"("kind":"fence","name":"a","speed_mps":5)"),
               "allowed only with kind \"speed");
  const std::string pond = R"("kind":"keep_out","name":"pond")";
  expect_error(collection(feature(pond, "[0,0]", "Point")),
               R"(feature 1 "pond": geometry: type: is "Point"; allowed are "Polygon")");
  expect_error(collection(R"({"type":"Feature","properties":{)" + pond + R"(},"geometry":null})"),
               "geometry: is no object");
  const std::string crs =
      R"({"type":"FeatureCollection","crs":{"type":"name","properties":{"name":"%"}},"features":[)" +
      feature(pond, kSquare) + "]}";
  const auto with_crs = [&](const std::string& name) {
    std::string text = crs;
    return text.replace(text.find('%'), 1, name);
  };
  expect_error(with_crs("urn:ogc:def:crs:EPSG::32618"), "crs: is \"urn:ogc:def:crs:EPSG::32618\"");
  EXPECT_EQ(error_of(with_crs("urn:ogc:def:crs:OGC:1.3:CRS84")), "no error");
}

TEST(ZoneFile, ErrorsNameRingAndPosition) {
  expect_error(file("[]"), "coordinates: must be an array that is not empty");
  expect_error(file("[3]"), "ring 1: has 0 positions; allowed are 4 and more");
  expect_error(file("[[[0,0],[1,0],[0,0]]]"), "ring 1: has 3 positions; allowed are 4 and more");
  expect_error(file("[[[0,0],[0.1,0],[0.1,0.1],[0,0.1]]]"), "ring 1: is not closed");
  expect_error(file("[[[0,0],[0,0],[0.001,0],[0,0]]]"), "fewer than 3 different positions");
  expect_error(file("[[[0,0],[0,0],[0,0],[0,0]]]"), "fewer than 3 different positions");
  expect_error(file("[[[0,0],[181,0],[1,1],[0,0]]]"),
               "position 2: has the longitude 181: allowed is -180 to 180 deg");
  expect_error(file("[[[0,0],[1,91],[1,1],[0,0]]]"), "has the latitude 91: allowed is -90 to 90");
  expect_error(file("[[[0,0],[NaN,0],[1,1],[0,0]]]"), "is no valid JSON");
  expect_error(file("[[[0,0],[1e999,0],[1,1],[0,0]]]"), "is no valid JSON");
  expect_error(file("[[[0,0],[null,0],[1,1],[0,0]]]"), "position 2: has null, which is no finite");
  expect_error(file("[[[0,0],[1],[1,1],[0,0]]]"), "position 2: is not [longitude, latitude]");
  expect_error(file("[[[0,0],[0.1,0.1],[0.1,0],[0,0.1],[0,0]]]"), "crosses or touches the edge");
  expect_error(file("[[[0,0],[0.1,0],[0.2,0],[0,0]]]"), "crosses or touches the edge");
  expect_error(file("[[[0,0],[0.2,0],[0.1,0],[0.2,0.1],[0,0.1],[0,0]]]"), "crosses or touches");
  expect_error(file("[[[179.9,0],[-179.9,0],[-179.9,1],[179.9,0]]]"), "antimeridian");
  const std::string outer = "[[0,0],[0.1,0],[0.1,0.1],[0,0.1],[0,0]]";
  expect_error(file("[" + outer + ",[[0.2,0.2],[0.3,0.2],[0.3,0.3],[0.2,0.2]]]"),
               "ring 2: is a hole that is not inside of ring 1");
  expect_error(file("[" + outer + ",[[0.05,0.05],[0.3,0.05],[0.05,0.07],[0.05,0.05]]]"),
               "crosses or touches");
  expect_error(file("[" + outer +
                    ",[[0.01,0.01],[0.09,0.01],[0.09,0.09],[0.01,0.01]]"
                    ",[[0.05,0.02],[0.06,0.02],[0.06,0.03],[0.05,0.02]]]"),
               "is a hole inside of another hole");
}

// Each is rejected, or read, in bounded time and memory.
TEST(ZoneFile, HostileFilesAreBounded) {
  expect_error(std::string(kMaxZoneFileBytes + 1, ' '), "is larger than 10000000 bytes");
  expect_error(std::string(kMaxZoneFileBytes, '['), "is nested deeper than 64 levels");
  std::string wide = "[0";
  for (int k = 0; k < 1'000'000; ++k) wide += ",0";
  expect_error(wide + "]", "has more than 400000 values");
  expect_error("{\"" + std::string(1'000'000, 'a') + "\":\xff}", "is no valid JSON");
  EXPECT_LT(error_of("{\"" + std::string(1'000'000, 'a')).size(), 400U);
  // A comb whose teeth all lie above one another: the most comparisons of edges.
  const auto comb = [](int teeth) {
    std::string ring = "[[[0,0]";
    for (int k = 1; k <= teeth; ++k) {
      ring += fmt::format(",[0.001,{:.9f}],[0.0000001,{:.9f}]", 1e-8 * k, 1e-8 * k + 0.5e-8);
    }
    return ring + ",[-0.001,0],[0,0]]]";
  };
  EXPECT_EQ(error_of(file(comb(9'990))), "no error");
  expect_error(file(comb(10'010)), "more than 20000 vertices");
  // Edges of 90 km count as 90 vertices.
  std::string zigzag = "[[[0,0]";
  for (int k = 1; k < 300; ++k) {
    zigzag += fmt::format(",[{},{:.3f}]", k % 2 == 0 ? 0.0 : 0.8, 0.01 * k);
  }
  expect_error(file(zigzag + ",[-0.1,1],[0,0]]]"), "more than 20000 vertices");
  std::string fences;
  for (int k = 0; k < 33; ++k) {
    fences += (k > 0 ? "," : "") + feature(R"("kind":"fence","name":"site")", kSquare);
  }
  expect_error(collection(fences), "is polygon 33 of fences; allowed are 32");
}

TEST(ZoneFile, OnlyRegularFilesAreRead) {
  const std::filesystem::path folder = test::fresh_folder();
  const auto message = [](const Result<GeodeticZones>& zones) {
    return zones ? std::string("no error") : zones.error().message;
  };
  EXPECT_NE(message(load_zones(folder / "none")).find("cannot open"), std::string::npos);
  EXPECT_NE(message(load_zones(folder)).find("is not a regular file"), std::string::npos);
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(message(load_zones(pipe)).find("is not a regular file"), std::string::npos);
}

TEST(ZoneParams, AreRelativeToTheConfigurationAndReportErrorsOfTheFile) {
  const std::filesystem::path folder = test::fresh_folder();
  std::ofstream(folder / "good.geojson") << file(kSquare);
  std::ofstream(folder / "bad.geojson") << file("[[[0,0],[1,0],[0,0]]]");
  std::ofstream(folder / "a.toml") << "[world]\nzones = \"good.geojson\"\n";
  std::ofstream(folder / "b.toml") << "[world]\nzones = \"bad.geojson\"\n";
  Result<ParamFile> a = ParamFile::load(folder / "a.toml");
  ASSERT_TRUE(a);
  EXPECT_EQ(read_zones(*a).zones.size(), 1U);
  EXPECT_TRUE(a->finish({}));
  Result<ParamFile> b = ParamFile::load(folder / "b.toml");
  ASSERT_TRUE(b);
  EXPECT_TRUE(read_zones(*b).empty());
  const Outcome outcome = b->finish({});
  ASSERT_FALSE(outcome);
  const std::string& message = outcome.error().message;
  EXPECT_NE(message.find("b.toml:2: [world] zones"), std::string::npos) << message;
  EXPECT_NE(message.find("bad.geojson: feature 1 \"pond\": coordinates: ring 1: has 3 positions"),
            std::string::npos)
      << message;
  const Result<ParamFile> none = ParamFile::parse("", "c.toml");
  ASSERT_TRUE(none);
  EXPECT_TRUE(read_zones(*none).empty());
}

}  // namespace
}  // namespace rcs
