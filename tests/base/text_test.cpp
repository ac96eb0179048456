#include "rcs/base/text.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "rcs/base/printable.h"

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

TEST(Text, ControlCharactersAreEscapedAndUtf8IsKept) {
  EXPECT_EQ(printable("a\tb\n"), "a\tb\n");
  EXPECT_EQ(printable("\x1b[31mred\r\x7f"), "\\u001b[31mred\\u000d\\u007f");
  EXPECT_EQ(printable_line("a\tb\n"), "a\\u0009b\\u000a");
  EXPECT_EQ(printable_line("\xc2\x9b"
                           "2J"),
            "\\u009b2J");
  EXPECT_EQ(printable(std::string("\0", 1)), "\\u0000");
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J"),
            "\\u009b2J")
      << "CSI as one character";
  EXPECT_EQ(printable("Gr\xc3\xbc\xc3\x9f"
                      "e \xc2\xb5 \xc2"),
            "Gr\xc3\xbc\xc3\x9f"
            "e \xc2\xb5 \xc2");
}

}  // namespace
}  // namespace rcs
