// `rcs view` on a bus.

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>

#include "lcmtypes/rcs/message_fields.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/cdr/cdr_message.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/tools/view/view_process.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

/// Notes every channel on the bus.
class Channels final : public BusMonitor {
 public:
  void receive(std::string_view channel, const std::uint8_t* /*data*/, std::size_t /*size*/,
               std::int64_t /*received_utime*/) noexcept override {
    seen.emplace(channel);
  }
  std::set<std::string> seen;
};

TEST(ViewLive, ShowsTheBusAndPublishesNothing) {
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create("");
  ASSERT_TRUE(bus) << bus.error().message;
  Channels channels;
  (*bus)->subscribe_all(&channels);
  ViewProcess view({"--port=0"});
  ASSERT_FALSE(view.port().empty());

  std::atomic<bool> stop{false};
  std::thread vehicle([&] {
    for (int i = 0; !stop; ++i) {
      nav_state_t nav{};
      nav.utime = 1'000'000 + 20'000 * i;
      nav.pose_valid = 1;
      nav.q_world_vehicle[0] = nav.q_local_vehicle[0] = nav.q_rolling_vehicle[0] = 1.0;
      nav.p_world_vehicle_m[0] = 0.02 * i;
      std::vector<std::uint8_t> bytes(static_cast<std::size_t>(nav.getEncodedSize()));
      (void)nav.encode(bytes.data(), 0, nav.getEncodedSize());
      (*bus)->publish("WM_NAV_STATE", bytes.data(), bytes.size());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });

  ViewClient client(view, "foxglove.websocket.v1");
  (void)client.subscribe(client.wait_for("advertise"), "/rcs/WM_NAV_STATE");
  double last = -1.0;
  for (int received = 0; received < 30;) {
    if (!client.read()) break;
    if (client.is_text()) continue;
    nav_state_t nav{};
    ASSERT_TRUE(cdr::read_message(client.data() + 13, client.size() - 13, &nav));
    EXPECT_GT(nav.p_world_vehicle_m[0], last);
    last = nav.p_world_vehicle_m[0];
    ++received;
  }
  ViewClient control(view, "rcs.view.v1");
  EXPECT_EQ(control.wait_for("source")["live"], true);
  control.send({{"op", "seek"}, {"t", 0.0}});
  EXPECT_THAT(control.wait_for("error")["message"].get<std::string>(), HasSubstr("present moment"));
  const auto timeline = nlohmann::json::parse(view.get("/api/timeline").body());
  EXPECT_GT(timeline["track"].size(), 0U);
  EXPECT_THAT(view.get("/metrics").body(), HasSubstr("rcs_navigation_mode{mode=\"ALIGN\"} 1"));
  stop = true;
  vehicle.join();
  EXPECT_EQ(view.end(SIGINT), 0);
  while ((*bus)->deliver_one(Stamp{})) {
  }
  EXPECT_THAT(channels.seen, testing::IsSubsetOf({"WM_NAV_STATE", "LCM_SELF_TEST"}));
  EXPECT_EQ(channels.seen.count("WM_NAV_STATE"), 1U);
}

}  // namespace
}  // namespace rcs::test
