#include "tools/driving/config_table.h"

#include <gtest/gtest.h>

namespace rcs::driving {
namespace {

const std::vector<std::pair<std::string, std::string>> kKeys = {{"a", "1"}, {"zones", "\"z\""}};

TEST(ConfigTable, IsAddedWhereItIsNotThere) {
  EXPECT_EQ(with_keys("", "world", kKeys), "\n[world]\na = 1\nzones = \"z\"\n");
  EXPECT_EQ(with_keys("[bg]\na = 3", "world", kKeys),
            "[bg]\na = 3\n\n[world]\na = 1\nzones = \"z\"\n");
  EXPECT_EQ(with_keys("[worlds]\na = 3\n", "world", {{"a", "1"}}),
            "[worlds]\na = 3\n\n[world]\na = 1\n");
}

TEST(ConfigTable, ItsKeysAreReplacedAndItsOthersStay) {
  EXPECT_EQ(with_keys("[world]  # of the site\r\nb = 2\n a=3\nab = 4\n\n[bg]\na = 5\n", "world",
                      {{"a", "1"}}),
            "[world]  # of the site\r\na = 1\nb = 2\nab = 4\n\n[bg]\na = 5\n");
  EXPECT_EQ(with_keys("[[world]]\na = 3\n", "world", {{"a", "1"}}),
            "[[world]]\na = 3\n\n[world]\na = 1\n")
      << "a list of tables; the parser names the error";
}

}  // namespace
}  // namespace rcs::driving
