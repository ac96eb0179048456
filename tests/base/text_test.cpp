#include "rcs/base/text.h"

#include <gtest/gtest.h>

#include <sstream>

namespace rcs {
namespace {

TEST(Text, ALongLineIsBrokenBetweenWords) {
  std::string line;
  for (int k = 0; k < 60; ++k) line += (k > 0 ? " word" : "word") + std::to_string(k);
  std::istringstream parts(wrapped(line, 4));
  std::string joined;
  for (std::string part; std::getline(parts, part);) {
    EXPECT_LE(part.size(), kTextColumns) << part;
    if (!joined.empty()) {
      EXPECT_EQ(part.substr(0, 5), "    w");
    }
    joined += joined.empty() ? part : " " + part.substr(4);
  }
  EXPECT_EQ(joined, line);
}

TEST(Text, ASimilarWordIsSuggestedAndADifferentOneIsNot) {
  EXPECT_EQ(suggestion("gate", {"gate_m", "rate_hz"}), "; did you mean gate_m?");
  EXPECT_EQ(suggestion("gate", {"wheel_radius_m"}), "");
  EXPECT_EQ(suggestion("x", {"y"}), "") << "another letter is no similarity";
  EXPECT_EQ(suggestion("gate", {}), "");
  EXPECT_EQ(most_similar("gate", {"rate_hz", "gates"}), "gates");
}

}  // namespace
}  // namespace rcs
