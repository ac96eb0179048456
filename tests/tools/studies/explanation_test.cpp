#include "tools/studies/explanation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
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

// A terminal would execute them.
TEST(Explanation, TextsOfTheBusHaveNoControlCharacters) {
  MessageHistory history;
  status_t status{};
  status.state = "DRIVING\x1b]0;title\x07";
  status.reason = "\x1b[2J";
  plan_t plan{};
  plan.issuer = "operator\x1b[31m";
  history.add(log_event(channel::kBgStatus, status, 9.0));
  history.add(log_event(channel::kMissionStatus, status, 9.0));
  history.add(log_event(channel::kBgPlan, plan, 9.0));
  const Explanation e =
      explanation_of(history, "run.log", Stamp(from_seconds(0.0)), Stamp(from_seconds(10.0)));
  EXPECT_THAT(e.text, HasSubstr("DRIVING\\u001b"));
  EXPECT_EQ(e.text.find('\x1b'), std::string::npos);
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

TEST(Explanation, EveryChoiceOfARouteIsExplainedWithReasons) {
  routes_t with_gps{};
  with_gps.issuer = "operator";
  with_gps.alert_limit_m = 5.0;
  with_gps.gps = 1;
  with_gps.route = {route(route_t::VERDICT_CHOSEN, 0.0, 13.0),
                    route(route_t::VERDICT_DEARER, 4.0, 4.6)};
  with_gps.route[1].cost_s = 20.0;
  with_gps.n = 2;
  routes_t without_gps = with_gps;
  without_gps.gps = 0;
  without_gps.route = {route(route_t::VERDICT_ABOVE_LIMIT, 0.0, 13.0),
                       route(route_t::VERDICT_CHOSEN, 4.0, 4.6)};
  routes_t none{};
  none.alert_limit_m = 5.0;
  const Stamp begin(from_seconds(100.0));
  const Explanation e = explanation_of_routes({{Stamp(from_seconds(112.0)), with_gps},
                                               {Stamp(from_seconds(160.0)), without_gps},
                                               {Stamp(from_seconds(170.0)), none}},
                                              "run.log", begin);
  EXPECT_THAT(e.text, HasSubstr("choices of a route: 3"));
  EXPECT_THAT(e.text,
              HasSubstr("60.0 s after the begin of the log\nwithout GPS, alert limit 5.0 m"));
  EXPECT_THAT(e.text, HasSubstr("no route exists"));
  const auto& choices = e.json["choices"];
  ASSERT_EQ(choices.size(), 3U);
  EXPECT_EQ(choices[0]["time_s"], 12.0);
  EXPECT_EQ(choices[0]["issuer"], "operator");
  EXPECT_EQ(choices[0]["candidates"][0]["reason"],
            "lowest cost; level above the limit of 5.0 m, possible with GPS");
  EXPECT_EQ(choices[0]["candidates"][1]["reason"], "20 s dearer than the chosen one");
  EXPECT_EQ(choices[1]["candidates"][0]["reason"],
            "level above the limit of 5.0 m: impossible without GPS");
  EXPECT_EQ(choices[1]["candidates"][1]["reason"], "lowest cost");
  EXPECT_EQ(choices[1]["candidates"][1]["length_m"], 480.0);
  EXPECT_TRUE(choices[2]["candidates"].empty());
  EXPECT_THAT(explanation_of_routes({}, "run.log", begin).text, HasSubstr("no route"));
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
