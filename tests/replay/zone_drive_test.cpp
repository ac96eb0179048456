// Closed-loop drives with zones: the whole chain in the simulator, judged by ground truth.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "modules/bg/bg_node.h"
#include "modules/bg/zone_ground.h"
#include "rcs/zones/zone_file.h"
#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tests/support/fresh_folder.h"
#include "tests/support/heap_guard.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

/// BG, whose allocations after its warm-up are counted.
class CountedBg final : public Node {
 public:
  CountedBg(std::unique_ptr<Node> node, std::int64_t* allocations)
      : node_(std::move(node)), allocations_(allocations) {}
  [[nodiscard]] const NodeInfo& info() const override { return node_->info(); }
  [[nodiscard]] Stamp next_wakeup() const override { return node_->next_wakeup(); }
  [[nodiscard]] Duration nominal_compute() const override { return node_->nominal_compute(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return node_->inboxes(); }
  void run(const Cycle& cycle) override {
    const HeapGuard guard;
    node_->run(cycle);
    constexpr std::int64_t kWarmUp = 400;  // 20 s: 15 s of them driving
    if (++cycles_ > kWarmUp) *allocations_ += guard.allocations();
  }

 private:
  std::unique_ptr<Node> node_;
  std::int64_t* allocations_;
  std::int64_t cycles_ = 0;
};

std::string feature(const char* properties, const std::vector<Vec2>& border,
                    const LocalFrame& world) {
  std::string text = std::string(R"({"type":"Feature","properties":{)") + properties +
                     R"(},"geometry":{"type":"Polygon","coordinates":[[)";
  for (std::size_t k = 0; k <= border.size(); ++k) {
    const Vec2& p = border[k % border.size()];
    const Geodetic g = world.to_geodetic({p.x(), p.y(), 0.0});
    text +=
        fmt::format("{}[{:.9f},{:.9f}]", k > 0 ? "," : "", degrees(g.lon_rad), degrees(g.lat_rad));
  }
  return text + "]]}}";
}

/// What the true outline of the vehicle did.
struct Outcome {
  driving::ClosedLoopRun run;
  double min_m = 1e9;  ///< clearance
  double fastest_in_yard_mps = 0.0;
  std::int64_t allocations = 0;
};

/// 100 m straight on over open ground, with a keep-out of 45 m across the way, within a fence.
class ZoneDrive : public testing::Test {
 protected:
  void SetUp() override {
    Result<sim::Scenario> scenario =
        sim::load_scenario(source_path("config/sim/closed_loop.toml"), {});
    ASSERT_TRUE(scenario.ok());
    scenario_ = *scenario;
    scenario_.course.waypoints_world = {{0.0, 0.0}, {100.0, 0.0}};
    // Trees and rocks lead a vehicle around places, too.
    scenario_.world.rocks.per_m2 = 0.0;
    scenario_.world.vegetation.bushes_per_m2 = 0.0;
    scenario_.world.vegetation.trees_per_m2 = 0.0;
    const LocalFrame world(scenario_.datum);
    path_ = fresh_folder() / "zones.geojson";
    std::ofstream(path_) << R"({"type":"FeatureCollection","features":[)"
                         << feature(R"("kind":"fence","name":"site")",
                                    {{-30.0, -50.0}, {130.0, -50.0}, {130.0, 50.0}, {-30.0, 50.0}},
                                    world)
                         << ","
                         << feature(R"("kind":"keep_out","name":"pond")",
                                    {{46.0, -20.0}, {54.0, -20.0}, {54.0, 25.0}, {46.0, 25.0}},
                                    world)
                         << ","
                         << feature(R"("kind":"speed","name":"yard","speed_mps":2)",
                                    {{80.0, -50.0}, {130.0, -50.0}, {130.0, 50.0}, {80.0, 50.0}},
                                    world)
                         << "]}";
    const Result<GeodeticZones> drawn = load_zones(path_);
    ASSERT_TRUE(drawn) << drawn.error().message;
    zones_ = drawn->in_world(world);
  }

  Outcome drive(bool with_zones, driving::Level level = driving::Level::kBg) {
    Outcome out;
    driving::ClosedLoopOptions options;
    options.level = level;
    options.vehicle_config = source_path("config/demo3.toml");
    if (with_zones) options.more_config = "zones = \"" + path_ + "\"\n";
    out.run = driving::run_closed_loop(scenario_, options,
                                       [&](const ParamFile& file, Bus* bus,
                                           const sim::Simulator&) -> Result<std::unique_ptr<Node>> {
                                         Result<std::unique_ptr<Node>> bg =
                                             bg::make_bg_node(file, bus);
                                         if (!bg) return bg.error();
                                         return std::unique_ptr<Node>(std::make_unique<CountedBg>(
                                             std::move(bg).value(), &out.allocations));
                                       });
    const bg::Body body(bg::Shape(), 30.0);
    for (const driving::ClosedLoopSample& s : out.run.trace) {
      const Vec3 ahead = s.T_world_vehicle.q * Vec3::UnitX();
      const Vec3& p = s.T_world_vehicle.p;
      const bg::Pose2d place{p.x(), p.y(), std::atan2(ahead.y(), ahead.x()), 0.0};
      out.min_m = std::min(out.min_m, bg::zone_clearance(zones_, body, place));
      // Beyond the border by more than the position error.
      if (p.x() > 81.0) out.fastest_in_yard_mps = std::max(out.fastest_in_yard_mps, s.speed_mps);
    }
    std::printf("%sleast clearance of the true outline %.2f m, in the yard at most %.1f m/s\n",
                describe(out.run).c_str(), out.min_m, out.fastest_in_yard_mps);
    for (const auto& [state, time_s] : out.run.states_s) {
      std::printf("%s %.1f s\n", state.c_str(), time_s);
    }
    return out;
  }

  sim::Scenario scenario_;
  std::string path_;
  Zones zones_;
};

TEST_F(ZoneDrive, AKeepOutAcrossTheWayIsNeverEnteredByTheTruePosition) {
  const Outcome out = drive(true);
  EXPECT_EQ(out.run.config_error, "");
  EXPECT_TRUE(out.run.done) << out.run.state << ": " << out.run.reason;
  EXPECT_EQ(out.run.reached, 1);
  EXPECT_GT(out.min_m, 0.0);
  EXPECT_LT(out.fastest_in_yard_mps, 2.3);
  if (HeapGuard::available()) {
    EXPECT_EQ(out.allocations, 0);
  }
}

TEST_F(ZoneDrive, TheVehicleLevelRoutesAroundIt) {
  const Outcome out = drive(true, driving::Level::kVisit);
  EXPECT_TRUE(out.run.done) << out.run.state << ": " << out.run.reason;
  EXPECT_EQ(out.run.reached, 1);
  EXPECT_GT(out.min_m, 3.0) << "the route keeps the alert limit from it";
}

TEST_F(ZoneDrive, ATaskIntoAKeepOutIsRefusedByTheNameOfTheZone) {
  scenario_.course.waypoints_world = {{0.0, 0.0}, {20.0, 0.0}, {50.0, 0.0}};
  scenario_.duration_s = 20.0;
  const Outcome out = drive(true, driving::Level::kVisit);
  EXPECT_FALSE(out.run.done);
  EXPECT_EQ(out.run.state, "REFUSED");
  EXPECT_EQ(out.run.reason, "command rejected: waypoint 2 is in keep-out 'pond'");
}

// Otherwise the tests above would show nothing.
TEST_F(ZoneDrive, WithoutZonesTheSameDriveCrossesIt) {
  const Outcome out = drive(false);
  EXPECT_TRUE(out.run.done) << out.run.state << ": " << out.run.reason;
  EXPECT_LT(out.min_m, -1.0);
  EXPECT_GT(out.fastest_in_yard_mps, 3.0);
}

}  // namespace
}  // namespace rcs::test
