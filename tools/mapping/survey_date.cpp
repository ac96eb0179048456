#include "tools/mapping/survey_date.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace rcs::mapping {
namespace {

/// Days from 1970-01-01 to a day of the Gregorian calendar, by counting March as the first month.
int days_of(int year, int month, int day) {
  const int y = month > 2 ? year : year - 1;
  const int m = month > 2 ? month - 3 : month + 9;
  return 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 1 - 719468;
}

const int kDays2000 = days_of(2000, 1, 1);

}  // namespace

int parse_date(const std::string& text) {
  int year = 0;
  int month = 0;
  int day = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%c", &year, &month, &day, &rest) != 3) return 0;
  if (year < 2000 || year > 2178 || month < 1 || month > 12 || day < 1) return 0;
  const int next_month = month == 12 ? days_of(year + 1, 1, 1) : days_of(year, month + 1, 1);
  if (days_of(year, month, day) >= next_month) return 0;
  return std::max(1, days_of(year, month, day) - kDays2000);
}

std::string date_text(int days) {
  if (days == 0) return "unknown";
  int year = 2000;
  while (days_of(year + 1, 1, 1) - kDays2000 <= days) ++year;
  int month = 1;
  while (month < 12 && days_of(year, month + 1, 1) - kDays2000 <= days) ++month;
  return fmt::format("{:04}-{:02}-{:02}", year, month,
                     days - (days_of(year, month, 1) - kDays2000) + 1);
}

}  // namespace rcs::mapping
