#include "sim/terrain/dem.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "rcs/base/linear.h"

namespace rcs::sim {
namespace {

constexpr int kMaxSide = 20000;
constexpr double kMetresPerDegree =
    111320.0;  // of latitude; for the scale of the relief, not geodesy

std::string_view next_word(std::string_view* text) {
  const auto blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  const auto first = std::find_if_not(text->begin(), text->end(), blank);
  const auto last = std::find_if(first, text->end(), blank);
  const std::string_view word(&*text->begin() + (first - text->begin()),
                              static_cast<std::size_t>(last - first));
  text->remove_prefix(static_cast<std::size_t>(last - text->begin()));
  return word;
}

bool to_number(std::string_view word, double* value) {
  const std::string copy(word);
  char* end = nullptr;
  *value = std::strtod(copy.c_str(), &end);
  return !copy.empty() && end == copy.c_str() + copy.size() && std::isfinite(*value);
}

struct Header {
  double ncols = 0.0;
  double nrows = 0.0;
  double xll = 0.0;
  double yll = 0.0;
  double cellsize = 0.0;
  double nodata = -9999.0;

  /// The field of a header key, in lower case; null: unknown.
  double* field(std::string_view key) {
    if (key == "ncols") return &ncols;
    if (key == "nrows") return &nrows;
    if (key == "xllcorner" || key == "xllcenter") return &xll;
    if (key == "yllcorner" || key == "yllcenter") return &yll;
    if (key == "cellsize") return &cellsize;
    if (key == "nodata_value") return &nodata;
    return nullptr;
  }
};

}  // namespace

Result<Dem> parse_esri_ascii(std::string_view text, const std::string& name) {
  Header header;
  while (true) {
    std::string_view rest = text;
    std::string key(next_word(&rest));
    if (key.empty() || std::isalpha(static_cast<unsigned char>(key[0])) == 0) break;
    std::transform(key.begin(), key.end(), key.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    double* const field = header.field(key);
    if (field == nullptr) {
      return Error{std::string(name).append(": unknown header key ").append(key)};
    }
    if (!to_number(next_word(&rest), field)) {
      return Error{std::string(name).append(": not a number: ").append(key)};
    }
    text = rest;
  }
  if (!(header.ncols >= 4 && header.ncols <= kMaxSide && header.nrows >= 4 &&
        header.nrows <= kMaxSide)) {
    return Error{name + ": ncols and nrows must be 4 to " + std::to_string(kMaxSide)};
  }
  if (!(header.cellsize > 0.0)) return Error{name + ": cellsize must be positive"};

  Dem dem;
  dem.width = static_cast<int>(header.ncols);
  dem.height = static_cast<int>(header.nrows);
  const bool geographic = header.cellsize < 0.1 && std::abs(header.xll) <= 360.0;
  const double middle_lat = radians(header.yll + 0.5 * header.nrows * header.cellsize);
  dem.cell_y_m = header.cellsize * (geographic ? kMetresPerDegree : 1.0);
  dem.cell_x_m = dem.cell_y_m * (geographic ? std::cos(middle_lat) : 1.0);

  const std::size_t width = static_cast<std::size_t>(dem.width);
  const std::size_t n = width * static_cast<std::size_t>(dem.height);
  dem.z_m.resize(n);
  std::vector<std::size_t> unknown;
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    double z = 0.0;
    if (!to_number(next_word(&text), &z)) {
      return Error{name + ": cell " + std::to_string(k + 1) + " of " + std::to_string(n) +
                   " is missing or not a number"};
    }
    // The first row of the file is the northernmost.
    const std::size_t at =
        (static_cast<std::size_t>(dem.height) - 1 - k / width) * width + k % width;
    dem.z_m[at] = static_cast<float>(z);
    if (z == header.nodata) {
      unknown.push_back(at);
    } else {
      sum += z;
    }
  }
  if (unknown.size() == n) return Error{name + ": all cells are unknown"};
  const float mean = static_cast<float>(sum / static_cast<double>(n - unknown.size()));
  for (const std::size_t at : unknown) dem.z_m[at] = mean;
  return dem;
}

}  // namespace rcs::sim
