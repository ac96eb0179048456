#include "tools/base/csv_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace rcs::tools {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsNan;

std::string complaint(const std::string& text, const std::string& column = "t") {
  const Result<CsvTable> table = CsvTable::parse(text, "a.csv");
  if (!table) return table.error().message;
  const Result<std::vector<double>> numbers = table->numbers(column);
  return numbers ? "accepted" : numbers.error().message;
}

TEST(CsvTable, ReadsColumnsByName) {
  const Result<CsvTable> table = CsvTable::parse(
      "\xef\xbb\xbf t , ax\r\n# a remark\r\n1.5, -2\r\n\r\n+2.5e0,\t1e-3 \r\n", "a.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->rows(), 2U);
  EXPECT_THAT(*table->numbers("t"), ElementsAre(1.5, 2.5));
  EXPECT_THAT(*table->numbers("ax"), ElementsAre(-2.0, 1e-3));
  EXPECT_EQ(table->place(0), "a.csv:3");
  EXPECT_EQ(table->place(1), "a.csv:5");
}

TEST(CsvTable, EmptyCellsAndAbsentColumnsAreMissing) {
  const Result<CsvTable> table =
      CsvTable::parse("t,a\n,1\nnan,1\nNaN,1\n-inf,1\nNA,1\nnull,1\n1e999,1\n7", "a.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_THAT(*table->numbers("t"),
              ElementsAre(IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), IsNan(), 7.0));
  EXPECT_TRUE(std::isnan(table->numbers("a")->back())) << "a row that ends early";
}

TEST(CsvTable, ErrorsNameFileLineAndColumn) {
  EXPECT_EQ(complaint("t\n1\n1.2.3\n"), "a.csv:3: column 't': '1.2.3' is not a number");
  EXPECT_EQ(complaint("t\n0x10\n"), "a.csv:2: column 't': '0x10' is not a number");
  EXPECT_EQ(complaint("t,a\n1,2,3\n"), "a.csv:2: 3 cells, but the header names 2 columns");
  EXPECT_EQ(complaint("t,t\n"), "a.csv:1: two columns are named 't'");
  EXPECT_EQ(complaint("t,,a\n"), "a.csv:1: column 2 has no name");
  EXPECT_EQ(complaint("s,a\n", "t"), "a.csv: no column 't'; columns: s, a");
  EXPECT_THAT(complaint(""), HasSubstr("no header"));
  EXPECT_THAT(complaint("t\n" + std::string("\x01\xff", 2) + std::string(100, 'x')),
              HasSubstr("'??xxx"));
  EXPECT_EQ(complaint("t\n+"), "a.csv:2: column 't': '+' is not a number");
}

TEST(CsvTable, AMissingFileIsNamed) {
  const Result<CsvTable> table = CsvTable::load("/nonexistent/a.csv");
  ASSERT_FALSE(table);
  EXPECT_THAT(table.error().message, HasSubstr("/nonexistent/a.csv"));
}

}  // namespace
}  // namespace rcs::tools
