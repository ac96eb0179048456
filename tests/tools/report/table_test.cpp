#include "tools/report/table.h"

#include <gtest/gtest.h>

#include <sstream>

namespace rcs::report {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(Table, ANarrowTableHasOneLineForEachRow) {
  EXPECT_EQ(to_text({{"run", "error [m]"}, {{"first run", "1.0"}, {"b", "-10.25"}}}),
            "run        error [m]\n"
            "first run        1.0\n"
            "b             -10.25\n");
}

TEST(Table, ATableOfWordsIsLeftAligned) {
  Table table{{"drill", "description"}, {{"d01", "GPS lost"}, {"d02_long", "GPS returns"}}};
  table.left = true;
  EXPECT_EQ(to_text(table),
            "drill     description\n"
            "d01       GPS lost\n"
            "d02_long  GPS returns\n");
}

TEST(Table, AWideTableFits100ColumnsByBreakingWideHeadersFirst) {
  Table table{{"a run with a long name"}, {{"the run, with all its sensors"}}};
  for (int k = 0; k < 9; ++k) {
    table.header.emplace_back("vertical error [m]");
    table.rows[0].emplace_back("-12.25");
  }
  const std::vector<std::string> lines = lines_of(to_text(table));
  for (const std::string& line : lines) EXPECT_LE(line.size(), 100U) << line;
  // Cells are broken only after the headers.
  table.header.resize(5);
  table.rows[0].resize(5);
  table.rows[0][1] = "0.25 / 0.50";
  table.header[1] = "error of the position at the end of the outage, horizontal [m]";
  const std::vector<std::string> wide = lines_of(to_text(table));
  EXPECT_EQ(wide.back().substr(0, 29), "the run, with all its sensors");
  EXPECT_NE(wide.back().find("0.25 / 0.50"), std::string::npos);
}

TEST(Table, EveryWordOfAWideTableIsPrinted) {
  Table table{{"name", "description"}, {{"d01", ""}}};
  for (int k = 0; k < 60; ++k) table.rows[0][1] += (k > 0 ? " word" : "word") + std::to_string(k);
  const std::string text = to_text(table);
  for (int k = 0; k < 60; ++k) {
    EXPECT_NE(text.find("word" + std::to_string(k)), std::string::npos) << k;
  }
  for (const std::string& line : lines_of(text)) EXPECT_LE(line.size(), 100U) << line;
}

}  // namespace
}  // namespace rcs::report
