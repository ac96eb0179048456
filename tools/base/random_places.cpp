#include "tools/base/random_places.h"

#include <cstddef>
#include <cstdio>

#include "tools/base/csv_table.h"

namespace rcs::tools {
namespace {

/// Limit of coordinates in messages, in the frame of a map.
bool plausible(const Vec2& p) {
  constexpr double kFarthest_m = 1e6;
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= kFarthest_m;
}

}  // namespace

std::optional<Vec2> parse_place(const std::string& text) {
  Vec2 p;
  int length = 0;
  const bool two = std::sscanf(text.c_str(), "%lf,%lf%n", &p.x(), &p.y(), &length) == 2;
  if (!two || text.size() != static_cast<std::size_t>(length) || !plausible(p)) return {};
  return p;
}

Result<std::vector<Vec2>> load_places(const std::string& path) {
  const Result<CsvTable> table = CsvTable::load(path);
  if (!table) return table.error();
  const Result<std::vector<double>> x = table->numbers("x_m");
  if (!x) return x.error();
  const Result<std::vector<double>> y = table->numbers("y_m");
  if (!y) return y.error();
  std::vector<Vec2> places;
  for (std::size_t k = 0; k < x->size(); ++k) {
    places.emplace_back((*x)[k], (*y)[k]);
    if (!plausible(places.back())) {
      return Error{table->place(k) + ": a coordinate is missing or exceeds 1000 km"};
    }
  }
  return places;
}

}  // namespace rcs::tools
