#include "tools/report/json_document.h"

#include <gtest/gtest.h>

#include <limits>

namespace rcs::report {
namespace {

TEST(JsonDocument, BeginsWithItsSchemaAndKeepsTheOrderOfItsKeys) {
  EXPECT_EQ(json_document("map info", {{"b", 1}, {"a", {1, 2}}, {"c", Json::object()}}),
            "{\n  \"schema\": \"rcs.map.info/1\",\n  \"b\": 1,\n  \"a\": [\n    1,\n    2\n  ],\n"
            "  \"c\": {}\n}\n");
}

TEST(JsonDocument, TheVersionOfADocumentIsInItsSchema) {
  EXPECT_EQ(schema_name("map info"), "rcs.map.info/1");
  EXPECT_EQ(schema_name("map locate"), "rcs.map.locate/2");
}

TEST(JsonDocument, NumbersHaveNoNoise) {
  const auto text = [](const std::string& key, double v) {
    const std::string document = json_document("x", {{key, v}});
    const std::size_t from = document.rfind(": ") + 2;
    return document.substr(from, document.find('\n', from) - from);
  };
  EXPECT_EQ(text("a", 0.1 + 0.2), "0.3");
  EXPECT_EQ(text("a", 2.53508), "2.53508") << "nlohmann prints 2.5350799999999998";
  EXPECT_EQ(text("a", 0.1F), "0.1");
  EXPECT_EQ(text("a", 3.0), "3.0") << "a number with a fraction in every document";
  EXPECT_EQ(text("a", -0.0), "0.0");
  EXPECT_EQ(text("a", 1.23456789e-9), "1.23457e-09");
  EXPECT_EQ(text("a", 512345.678912), "512345.6789");
  EXPECT_EQ(text("lat_deg", 49.0112128044), "49.0112128");
  EXPECT_EQ(text("information", 46787864385351.2), "46787864400000.0");
  EXPECT_EQ(text("a", std::numeric_limits<double>::quiet_NaN()), "null");
  EXPECT_EQ(text("a", std::numeric_limits<double>::infinity()), "null");
}

TEST(JsonDocument, TextThatIsNotUtf8IsReplaced) {
  EXPECT_TRUE(Json::accept(json_document("x", {{"a", "\xff"}, {"b\xff", 1}})));
}

}  // namespace
}  // namespace rcs::report
