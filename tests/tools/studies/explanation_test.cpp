#include "tools/studies/explanation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"

namespace rcs::studies {
namespace {

using testing::HasSubstr;

template <class Message>
LogEvent log_event(const char* channel, const Message& m, double t_s) {
  LogEvent event;
  event.stamp = Stamp(from_seconds(t_s));
  event.channel = channel;
  event.data.resize(static_cast<std::size_t>(m.getEncodedSize()));
  EXPECT_EQ(m.encode(event.data.data(), 0, m.getEncodedSize()), m.getEncodedSize());
  return event;
}

route_t route(std::int8_t verdict, double weight, double level_m) {
  route_t r{};
  r.verdict = verdict;
  r.poverty_weight = weight;
  r.length_m = 480.0;
  r.time_s = 160.0;
  r.level_max_m = level_m;
  return r;
}

TEST(Explanation, TheMissionItsRoutesAndItsEventsAreExplained) {
  MessageHistory history;
  status_t status{};
  status.state = "DRIVING_NO_GPS";
  routes_t routes{};
  routes.alert_limit_m = 5.0;
  routes.route = {route(route_t::VERDICT_ABOVE_LIMIT, 0.0, 13.0),
                  route(route_t::VERDICT_CHOSEN, 4.0, 4.6),
                  route(route_t::VERDICT_DEARER, 16.0, std::numeric_limits<double>::infinity())};
  routes.n = 3;
  event_t event{};
  event.node = "mission";
  event.code = "route.chosen";
  history.add(log_event(channel::kMissionStatus, status, 9.0));
  history.add(log_event(channel::kMissionRoutes, routes, 7.0));
  history.add(log_event(channel::kMissionEvent, event, 8.0));
  event.node = "up";
  history.add(log_event(channel::kUpEvent, event, 8.0));
  const Explanation e =
      explanation_of(history, "run.log", Stamp(from_seconds(0.0)), Stamp(from_seconds(10.0)));
  EXPECT_THAT(e.text, HasSubstr("mission (1.0 s ago): DRIVING_NO_GPS"));
  EXPECT_THAT(e.text, HasSubstr("above limit"));
  EXPECT_THAT(e.text, HasSubstr("without GPS, alert limit 5.0 m"));
  EXPECT_THAT(e.text, HasSubstr("mission: route.chosen"));
  EXPECT_THAT(e.text, HasSubstr("up: route.chosen"));
  const auto& candidates = e.json["mission"]["routes"]["candidates"];
  ASSERT_EQ(candidates.size(), 3U);
  EXPECT_EQ(candidates[1]["verdict"], "chosen");
  EXPECT_EQ(e.json["mission"]["status"]["state"], "DRIVING_NO_GPS");
}

TEST(Explanation, WithoutAMissionNothingIsStatedOfIt) {
  MessageHistory history;
  history.now = Stamp(from_seconds(10.0));
  const Explanation e = explanation_of(history, "run.log", Stamp(), Stamp(from_seconds(10.0)));
  EXPECT_EQ(e.text.find("mission"), std::string::npos);
  EXPECT_TRUE(e.json["mission"]["routes"].is_null());
}

}  // namespace
}  // namespace rcs::studies
