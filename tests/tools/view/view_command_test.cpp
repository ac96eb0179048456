// `rcs view` with a log: command line, server, clients.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/message_fields.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/cdr/cdr_message.h"
#include "rcs/node/budget.h"
#include "rcs/node/log/log_file.h"
#include "tests/tools/view/view_process.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

constexpr double kDuration_s = 10.0;

class ViewCommand : public RcsCommand {
 protected:
  /// Ten seconds: poses at 50 Hz, whose x is the time, and maps of 1 MB at 20 Hz.
  ViewCommand() {
    Result<LogWriter> writer = LogWriter::create(log_);
    map_patch_t patch{};
    patch.cell_m = 0.25;
    patch.width = patch.height = 400;
    patch.n = patch.width * patch.height;
    const auto n = static_cast<std::size_t>(patch.n);
    patch.height_cm.resize(n);
    patch.step_cm.resize(n);
    patch.slope_deg.resize(n);
    patch.roughness_cm.resize(n);
    patch.flags.resize(n);
    for (int i = 0; i <= 500; ++i) {
      const Duration at = from_seconds(0.02 * i);
      nav_state_t nav{};
      nav.utime = to_utime(kBegin + at);
      nav.pose_valid = 1;
      nav.q_world_vehicle[0] = nav.q_local_vehicle[0] = nav.q_rolling_vehicle[0] = 1.0;
      nav.p_world_vehicle_m[0] = seconds(at);
      write(&writer.value(), at, "WM_NAV_STATE", nav);
      if (i % 5 == 0) write(&writer.value(), at, "WM_MAP_PATCH", patch);
    }
    EXPECT_TRUE(writer->close());
  }

  template <class T>
  static void write(LogWriter* writer, Duration at, const char* channel, const T& message) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    (void)message.encode(bytes.data(), 0, message.getEncodedSize());
    EXPECT_TRUE(writer->write(kBegin + at, channel, bytes.data(), bytes.size()));
  }
  /// The x of the next pose that the client receives.
  static double next_pose(ViewClient* client) {
    while (client->read()) {
      if (client->is_text()) continue;
      nav_state_t nav{};
      EXPECT_TRUE(cdr::read_message(client->data() + 13, client->size() - 13, &nav));
      return nav.p_world_vehicle_m[0];
    }
    return -1.0;
  }

  static constexpr Stamp kBegin = from_utime(1'700'000'000'000'000);
  std::string log_ = folder_ + "/run.log";
};

TEST_F(ViewCommand, CommandLineErrorsNameTheOption) {
  EXPECT_EQ(rcs("view " + log_ + " --shot soon -o a.png"), 2);
  EXPECT_THAT(messages(), HasSubstr("--shot soon: expected t=SECONDS"));
  EXPECT_EQ(rcs("view " + log_ + " --shot t=1"), 2);
  EXPECT_THAT(messages(), HasSubstr("--out"));
  EXPECT_EQ(rcs("view --shot t=1 -o a.png"), 2);
  EXPECT_THAT(messages(), HasSubstr("LOG"));
  EXPECT_EQ(rcs("view " + log_ + " --shot t=1 -o a.png --size 5x5"), 2);
  EXPECT_THAT(messages(), HasSubstr("--size 5x5"));
  EXPECT_EQ(rcs("view " + log_ + " --port 70000"), 2);
  EXPECT_EQ(rcs("view " + log_ + " --panel x --shot t=1 -o a.png"), 2);
  EXPECT_EQ(rcs("view " + folder_ + "/none.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("none.log: file does not exist"));
}

TEST_F(ViewCommand, InputsThatCannotBeShownAreErrors) {
  std::ofstream(folder_ + "/empty.log").close();
  EXPECT_EQ(rcs("view --port 0 " + folder_ + "/empty.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("empty.log: no message of this system"));
  EXPECT_EQ(rcs("view " + log_ + " --shot t=99 -o " + folder_ + "/a.png"), 3);
  EXPECT_THAT(messages(), HasSubstr("ends after 10.0 s"));
  EXPECT_EQ(rcs("view " + log_ + " --host 203.0.113.7"), 3);
  EXPECT_THAT(messages(), HasSubstr("203.0.113.7"));
}

TEST_F(ViewCommand, AShotWithoutChromiumNamesThePackage) {
  const std::string command = "env PATH=" + folder_ + " " + variable("RCS_BIN_DIR") +
                              "/rcs_view --shot t=1 -o " + folder_ + "/a.png " + log_ + " 2>" +
                              folder_ + "/messages";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c)
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_THAT(messages(), HasSubstr("apt-get install chromium"));
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/a.png"));
}

TEST_F(ViewCommand, FirstLineIsTheAddressAndSignalsEndIt) {
  for (const int signal : {SIGINT, SIGTERM}) {
    ViewProcess view({log_, "--port=0"});
    EXPECT_THAT(view.url(), testing::MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/"));
    EXPECT_EQ(view.end(signal), 0);
  }
}

TEST_F(ViewCommand, APortInUseIsAnErrorWithAdvice) {
  const ViewProcess view({log_, "--port=0"});
  EXPECT_EQ(rcs("view " + log_ + " --port " + view.port()), 3);
  EXPECT_THAT(messages(), HasSubstr("port " + view.port()));
  EXPECT_THAT(messages(), HasSubstr("--port 0"));
}

TEST_F(ViewCommand, ServesThePageAndNothingElse) {
  const ViewProcess view({log_, "--port=0"});
  const auto page = view.get("/");
  EXPECT_EQ(page.result_int(), 200U);
  EXPECT_THAT(page.body(), HasSubstr("main.js"));
  EXPECT_THAT(std::string(page["Content-Security-Policy"]), HasSubstr("default-src 'self'"));
  EXPECT_THAT(std::string(view.get("/main.js")[http::field::content_type]),
              HasSubstr("javascript"));
  EXPECT_EQ(view.get("/", http::verb::head).body(), "");
  EXPECT_EQ(view.get("/../etc/passwd").result_int(), 404U);
  EXPECT_EQ(view.get("/api/why").result_int(), 400U);
  EXPECT_EQ(view.get("/", http::verb::post).result_int(), 405U);
  EXPECT_EQ(view.get("/", http::verb::get, {{http::field::host, "evil.example"}}).result_int(),
            403U);
}

TEST_F(ViewCommand, TimelineExplanationAndMetrics) {
  const ViewProcess view({log_, "--port=0"});
  const auto timeline = nlohmann::json::parse(view.get("/api/timeline").body());
  EXPECT_EQ(timeline["lanes"]["mode"][0][1], "ALIGN");
  EXPECT_GT(timeline["track"].size(), 20U);
  const auto why = nlohmann::json::parse(view.get("/api/why?t=5").body());
  EXPECT_NEAR(why["time_s"].get<double>(), 5.0, 1e-9);
  EXPECT_EQ(why["belief"]["mode"], "ALIGN");
  EXPECT_EQ(rcs("why " + log_ + " 5 --json"), 0);
  const auto expected = nlohmann::json::parse(out());
  EXPECT_EQ(why["belief"]["mode"], expected["belief"]["mode"]);
  EXPECT_EQ(why["inputs"].size(), expected["inputs"].size());
  const std::string metrics = view.get("/metrics").body();
  EXPECT_THAT(metrics, HasSubstr("# TYPE rcs_navigation_mode gauge"));
  EXPECT_THAT(metrics, HasSubstr("rcs_navigation_mode{mode=\"ALIGN\"} 1"));
  EXPECT_THAT(metrics, HasSubstr("rcs_view_clients 0"));
}

TEST_F(ViewCommand, ASubscriberReceivesTheMessageOfTheMoment) {
  const ViewProcess view({log_, "--port=0"});
  ViewClient client(view, "foxglove.websocket.v1");
  ASSERT_FALSE(client.error()) << client.error().message();
  EXPECT_EQ(client.wait_for("serverInfo")["capabilities"].size(), 0U);
  const nlohmann::json topics = client.wait_for("advertise");
  const std::uint32_t id = client.subscribe(topics, "/rcs/WM_NAV_STATE");
  EXPECT_NEAR(next_pose(&client), 0.0, 1e-9) << "the begin of the log";
  ViewClient control(view, "rcs.view.v1");
  ASSERT_FALSE(control.error());
  EXPECT_EQ(control.wait_for("source")["live"], false);
  for (const double t : {9.99, 3.0, 7.005}) {
    control.send({{"op", "seek"}, {"t", t}});
    EXPECT_NEAR(next_pose(&client), 0.02 * std::floor(t / 0.02 + 1e-9), 1e-9) << t;
  }
  EXPECT_EQ(client.data()[0], 1);
  EXPECT_EQ(client.data()[1], id);
  // Played, the poses grow.
  control.send({{"op", "play"}});
  double last = 7.0;
  for (int i = 0; i < 20; ++i) {
    const double x = next_pose(&client);
    EXPECT_GE(x, last);
    last = x;
  }
}

TEST_F(ViewCommand, RequestsThatAreNotOfferedAreAnsweredAndChangeNothing) {
  const ViewProcess view({log_, "--port=0"});
  ViewClient client(view, "foxglove.websocket.v1");
  (void)client.wait_for("advertise");
  client.send({{"op", "advertise"}, {"channels", nlohmann::json::array()}});
  EXPECT_THAT(client.wait_for("status")["message"].get<std::string>(), HasSubstr("receive only"));
  client.send({{"op", "subscribe"},
               {"subscriptions", nlohmann::json::array({{{"id", 1}, {"channelId", 99'999}}})}});
  EXPECT_THAT(client.wait_for("status")["message"].get<std::string>(),
              HasSubstr("no channel 99999"));
  ViewClient control(view, "rcs.view.v1");
  (void)control.wait_for("state");
  control.send({{"op", "seek"}});
  EXPECT_THAT(control.wait_for("error")["message"].get<std::string>(), HasSubstr("\"t\""));
}

TEST_F(ViewCommand, PagesOfOtherServersAndOtherProtocolsAreRefused) {
  const ViewProcess view({log_, "--port=0"});
  EXPECT_TRUE(ViewClient(view, "foxglove.websocket.v1", "https://evil.example").error());
  EXPECT_TRUE(ViewClient(view, "other").error());
  EXPECT_FALSE(ViewClient(view, "foxglove.websocket.v1", "http://localhost:3000").error());
  const ViewProcess open({log_, "--port=0", "--allow-origin=https://app.example.org"});
  EXPECT_FALSE(ViewClient(open, "foxglove.websocket.v1", "https://app.example.org").error());
}

/// A client that never reads: the others receive as before, memory is bounded, and it is dropped.
TEST_F(ViewCommand, AClientThatNeverReadsDelaysNothingAndIsDropped) {
  const ViewProcess view({log_, "--port=0"});
  ViewClient control(view, "rcs.view.v1");
  ViewClient reader(view, "foxglove.websocket.v1");
  (void)reader.subscribe(reader.wait_for("advertise"), "/rcs/WM_NAV_STATE");
  (void)next_pose(&reader);
  ViewClient stuck(view, "foxglove.websocket.v1");
  const nlohmann::json topics = stuck.wait_for("advertise");
  (void)stuck.subscribe(topics, "/rcs/WM_MAP_PATCH");
  (void)stuck.subscribe(topics, "/wm/grid_map");
  control.send({{"op", "play"}});
  const long before_kb = view.resident_kb();
  double worst_s = 0.0;
  double last_x = next_pose(&reader);
  StageClock wait;
  while (last_x < kDuration_s - 0.1) {
    wait.start_cycle();
    const double x = next_pose(&reader);
    wait.end_cycle();
    ASSERT_GE(x, 0.0);
    worst_s = std::max(worst_s, seconds(wait.cycle_wall()) - (x - last_x));
    last_x = x;
  }
  const long grown_kb = view.resident_kb() - before_kb;
  std::printf("client that never reads: other client at most %.0f ms late, memory +%ld kB\n",
              1e3 * worst_s, grown_kb);
  EXPECT_LT(worst_s, 3.0) << "far more than a loaded computer delays a client by itself";
  EXPECT_LT(grown_kb, 40'000) << "at most 16 MB wait for a client";
  for (int i = 0; i < 200 && view.metric("rcs_view_clients_dropped_total") < 1.0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(view.metric("rcs_view_clients_dropped_total"), 1.0);
  EXPECT_GT(view.metric("rcs_view_messages_dropped_total"), 10.0);
  while (stuck.read()) {
  }
  EXPECT_TRUE(stuck.error());
}

}  // namespace
}  // namespace rcs::test
