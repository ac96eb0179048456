// What clients request, and which requests are accepted.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tools/view/server/control_protocol.h"
#include "tools/view/server/foxglove_protocol.h"
#include "tools/view/server/query.h"
#include "tools/view/server/request_policy.h"

namespace rcs::view {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(FoxgloveProtocol, ServerInfoOffersNothingThatAClientCouldPublish) {
  const auto json = nlohmann::json::parse(server_info("name", "1"));
  EXPECT_EQ(json["op"], "serverInfo");
  EXPECT_TRUE(json["capabilities"].empty());
}

TEST(FoxgloveProtocol, AdvertisesTheTopicsOfTheChannelsWithSchemas) {
  const TopicTable topics;
  const auto json = nlohmann::json::parse(advertisement(topics, channels_of("GPS_FIX")));
  EXPECT_EQ(json["op"], "advertise");
  ASSERT_EQ(json["channels"].size(), 2U);
  for (const auto& channel : json["channels"]) {
    EXPECT_EQ(channel["encoding"], "cdr");
    EXPECT_EQ(channel["schemaEncoding"], "ros2msg");
    EXPECT_EQ(topics.find(channel["id"].get<std::uint32_t>())->name, channel["topic"]);
  }
  EXPECT_EQ(json["channels"][0]["schemaName"], "sensor_msgs/msg/NavSatFix");
  EXPECT_EQ(json["channels"][1]["topic"], "/rcs/GPS_FIX");
}

TEST(FoxgloveProtocol, HeaderOfAMessageIsLittleEndian) {
  const auto header = message_header(0x01020304, 0x1122334455667788);
  const std::array<std::uint8_t, 13> expected = {1,    4,    3,    2,    1,    0x88, 0x77,
                                                 0x66, 0x55, 0x44, 0x33, 0x22, 0x11};
  EXPECT_EQ(header, expected);
}

TEST(FoxgloveProtocol, ParsesSubscribeAndUnsubscribe) {
  const ClientRequest subscribe = parse_request(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]})");
  EXPECT_THAT(subscribe.problem, IsEmpty());
  ASSERT_EQ(subscribe.subscribe.size(), 2U);
  EXPECT_EQ(subscribe.subscribe[1].id, 1U);
  EXPECT_EQ(subscribe.subscribe[1].topic, 5U);
  const ClientRequest unsubscribe =
      parse_request(R"({"op":"unsubscribe","subscriptionIds":[0,7]})");
  EXPECT_THAT(unsubscribe.problem, IsEmpty());
  EXPECT_THAT(unsubscribe.unsubscribe, testing::ElementsAre(0, 7));
}

TEST(FoxgloveProtocol, RejectsWhatIsNotARequestAndNamesIt) {
  for (const char* text :
       {"", "{", "[]", "3", "null", R"({"op":1})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":{}})", R"({"op":"subscribe","subscriptions":[1]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":3}]})",
        R"({"op":"unsubscribe","subscriptionIds":["a"]})", "\xff\xfe"}) {
    const ClientRequest request = parse_request(text);
    EXPECT_FALSE(request.problem.empty()) << text;
    EXPECT_TRUE(request.unsubscribe.empty()) << text;
  }
  EXPECT_THAT(parse_request(R"({"op":"advertise","channels":[]})").problem,
              HasSubstr("receive only"));
}

TEST(FoxgloveProtocol, StatusWithBytesThatAreNotUtf8IsJson) {
  const std::string text = status_message(StatusLevel::kError,
                                          "a\xff"
                                          "b");
  EXPECT_TRUE(nlohmann::json::accept(text)) << text;
}

TEST(ControlProtocol, ParsesEachOperation) {
  using Kind = ControlRequest::Kind;
  EXPECT_EQ(parse_control(R"({"op":"play"})").kind, Kind::kPlay);
  EXPECT_EQ(parse_control(R"({"op":"pause"})").kind, Kind::kPause);
  const ControlRequest seek = parse_control(R"({"op":"seek","t":97.5})");
  EXPECT_EQ(seek.kind, Kind::kSeek);
  EXPECT_DOUBLE_EQ(seek.value, 97.5);
  EXPECT_EQ(parse_control(R"({"op":"speed","value":2})").kind, Kind::kSpeed);
}

TEST(ControlProtocol, RejectsOtherTexts) {
  for (const char* text :
       {"", "[]", R"({"op":"stop"})", R"({"op":"seek"})", R"({"op":"seek","t":"1"})",
        R"({"op":"seek","t":1e999})", R"({"op":"speed","value":null})"}) {
    EXPECT_EQ(parse_control(text).kind, ControlRequest::Kind::kProblem) << text;
    EXPECT_FALSE(parse_control(text).problem.empty()) << text;
  }
}

TEST(RequestPolicy, AcceptsAddressesAndTheNameOfThisServerOnly) {
  const RequestPolicy policy{"vehicle.lan", {}};
  for (const char* host : {"127.0.0.1:8765", "localhost:8765", "localhost", "[::1]:80", "10.0.0.5",
                           "vehicle.lan:8765"}) {
    EXPECT_TRUE(policy.allows_host(host)) << host;
  }
  // A name of someone else may resolve to 127.0.0.1.
  for (const char* host :
       {"", "evil.example", "evil.example:8765", "127.0.0.1.evil.example", "["}) {
    EXPECT_FALSE(policy.allows_host(host)) << host;
  }
}

TEST(RequestPolicy, PagesOfOtherServersMayNotConnect) {
  const RequestPolicy policy{"127.0.0.1", {"https://app.example.org"}};
  const char* host = "10.0.0.5:8765";
  for (const char* origin : {"", "http://10.0.0.5:8765", "http://localhost:3000",
                             "http://127.0.0.1", "file://", "https://app.example.org"}) {
    EXPECT_TRUE(policy.allows_origin(origin, host)) << origin;
  }
  for (const char* origin :
       {"null", "https://evil.example", "http://10.0.0.5", "http://10.0.0.5:80",
        "https://app.example.org.evil.example", "http://localhost.evil.example",
        "http://127.0.0.1.evil.example", "http://127.evil.example:8765"}) {
    EXPECT_FALSE(policy.allows_origin(origin, host)) << origin;
  }
}

TEST(Query, FindsNumbersByName) {
  EXPECT_EQ(path_of("/api/why?t=1"), "/api/why");
  EXPECT_EQ(query_of("/api/why?t=1"), "t=1");
  EXPECT_EQ(query_of("/api/why"), "");
  EXPECT_EQ(number_of("a=1&t=97.5", "t"), 97.5);
  for (const char* query :
       {"", "t", "t=", "t=x", "t=1x", "t=nan", "t=inf", "at=1", "t=1e999", "&&="}) {
    EXPECT_EQ(number_of(query, "t"), std::nullopt) << query;
  }
}

}  // namespace
}  // namespace rcs::view
