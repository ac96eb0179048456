#include "tools/clouds/cloud_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

namespace rcs::clouds {
namespace {

constexpr std::size_t kMaxNumbers = 10'000;  // of a point

std::size_t size_of(Number type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

template <class T>
double load(const std::uint8_t* at) {
  T v{};
  std::memcpy(&v, at, sizeof v);
  return static_cast<double>(v);
}

std::vector<std::string> words(std::string_view line) {
  std::istringstream in{std::string(line)};
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

std::optional<std::int64_t> whole(const std::string& word) {
  std::int64_t v = 0;
  const std::from_chars_result r = std::from_chars(word.data(), word.data() + word.size(), v);
  if (r.ec != std::errc() || r.ptr != word.data() + word.size() || v < 0) return std::nullopt;
  return v;
}

std::optional<Number> pcd_number(const std::string& type, const std::string& size) {
  constexpr std::array<std::pair<const char*, Number>, 8> kTypes = {{{"I1", Number::kI8},
                                                                     {"U1", Number::kU8},
                                                                     {"I2", Number::kI16},
                                                                     {"U2", Number::kU16},
                                                                     {"I4", Number::kI32},
                                                                     {"U4", Number::kU32},
                                                                     {"F4", Number::kF32},
                                                                     {"F8", Number::kF64}}};
  for (const auto& [name, number] : kTypes) {
    if (type + size == name) return number;
  }
  return std::nullopt;
}

std::optional<Number> ply_number(const std::string& type) {
  constexpr std::array<std::pair<const char*, Number>, 16> kTypes = {{{"char", Number::kI8},
                                                                      {"int8", Number::kI8},
                                                                      {"uchar", Number::kU8},
                                                                      {"uint8", Number::kU8},
                                                                      {"short", Number::kI16},
                                                                      {"int16", Number::kI16},
                                                                      {"ushort", Number::kU16},
                                                                      {"uint16", Number::kU16},
                                                                      {"int", Number::kI32},
                                                                      {"int32", Number::kI32},
                                                                      {"uint", Number::kU32},
                                                                      {"uint32", Number::kU32},
                                                                      {"float", Number::kF32},
                                                                      {"float32", Number::kF32},
                                                                      {"double", Number::kF64},
                                                                      {"float64", Number::kF64}}};
  for (const auto& [name, number] : kTypes) {
    if (type == name) return number;
  }
  return std::nullopt;
}

bool is_number(std::string_view word, double* out) {
  // Non-finite numbers as printed by C mean a point without a return.
  if (word == "nan" || word == "-nan" || word == "inf" || word == "-inf" || word == "NaN") {
    *out = std::nan("");
    return true;
  }
  const char* const begin = word.data() + (!word.empty() && word[0] == '+' ? 1 : 0);
  const char* const end = word.data() + word.size();
  const std::from_chars_result r = std::from_chars(begin, end, *out);
  return r.ec == std::errc() && r.ptr == end;
}

}  // namespace

double load(Number type, const std::uint8_t* at) {
  switch (type) {
    case Number::kI8:
      return load<std::int8_t>(at);
    case Number::kU8:
      return load<std::uint8_t>(at);
    case Number::kI16:
      return load<std::int16_t>(at);
    case Number::kU16:
      return load<std::uint16_t>(at);
    case Number::kI32:
      return load<std::int32_t>(at);
    case Number::kU32:
      return load<std::uint32_t>(at);
    case Number::kF32:
      return load<float>(at);
    case Number::kF64:
      break;
  }
  return load<double>(at);
}

std::optional<std::size_t> CloudLayout::index(std::string_view name) const {
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].name == name) return i;
  }
  return std::nullopt;
}

std::size_t CloudLayout::offset(std::size_t index) const {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < index; ++i) bytes += size_of(fields[i].type);
  return bytes;
}

Result<std::array<std::size_t, 3>> CloudLayout::axes(const std::string& name) const {
  std::array<std::size_t, 3> at{};
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::optional<std::size_t> found = index(kAxes[k]);
    if (!found) return Error{fmt::format("{}: no field {}", name, kAxes[k])};
    at[k] = *found;
  }
  return at;
}

std::string_view next_line(std::string_view* text) {
  const std::size_t end = std::min(text->find('\n'), text->size());
  std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

Result<CloudLayout> parse_pcd_header(std::string_view text, const std::string& name) {
  CloudLayout layout;
  const std::size_t all = text.size();
  std::vector<std::string> fields;
  std::vector<std::string> sizes;
  std::vector<std::string> types;
  std::vector<std::string> counts;
  std::int64_t width = -1;
  std::int64_t height = 1;
  std::int64_t points = -1;
  for (;;) {
    if (text.empty()) return Error{name + ": no DATA line: not a PCD file, or cut off"};
    const std::vector<std::string> line = words(next_line(&text));
    ++layout.header_lines;
    if (line.empty() || line[0][0] == '#') continue;
    const std::vector<std::string> rest(line.begin() + 1, line.end());
    const std::optional<std::int64_t> number = rest.empty() ? std::nullopt : whole(rest[0]);
    const auto wrong = [&] {
      return Error{fmt::format("{}:{}: unknown keyword {}", name, layout.header_lines, line[0])};
    };
    if (line[0] == "FIELDS") {
      fields = rest;
    } else if (line[0] == "SIZE") {
      sizes = rest;
    } else if (line[0] == "TYPE") {
      types = rest;
    } else if (line[0] == "COUNT") {
      counts = rest;
    } else if (line[0] == "WIDTH" || line[0] == "HEIGHT" || line[0] == "POINTS") {
      if (!number) return wrong();
      (line[0] == "WIDTH" ? width : line[0] == "HEIGHT" ? height : points) = *number;
    } else if (line[0] == "DATA") {
      if (rest.empty() || (rest[0] != "ascii" && rest[0] != "binary")) {
        return Error{fmt::format("{}:{}: DATA must be ascii or binary", name, layout.header_lines)};
      }
      layout.ascii = rest[0] == "ascii";
      break;
    } else if (line[0] != "VERSION" && line[0] != "VIEWPOINT") {
      return wrong();
    }
  }
  layout.data_at = all - text.size();
  if (counts.empty()) counts.assign(fields.size(), "1");
  if (sizes.size() != fields.size() || types.size() != fields.size() ||
      counts.size() != fields.size()) {
    return Error{name + ": FIELDS, SIZE, TYPE and COUNT differ in length"};
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::optional<Number> number = pcd_number(types[i], sizes[i]);
    const std::optional<std::int64_t> count = whole(counts[i]);
    if (!number || !count || *count < 1) {
      return Error{fmt::format("{}: field {}: unknown type or size", name, fields[i])};
    }
    if (layout.fields.size() + static_cast<std::size_t>(*count) > kMaxNumbers) {
      return Error{fmt::format("{}: more than {} numbers per point", name, kMaxNumbers)};
    }
    for (std::int64_t k = 0; k < *count; ++k) layout.fields.push_back({fields[i], *number});
  }
  // Bounded so that their product fits an index.
  constexpr std::int64_t kMaxSide = std::numeric_limits<int>::max();
  if (width > kMaxSide || height > kMaxSide) {
    return Error{
        fmt::format("{}: WIDTH {} and HEIGHT {}: more than {}", name, width, height, kMaxSide)};
  }
  if (points < 0 && width < 0) return Error{name + ": POINTS or WIDTH is required"};
  layout.records = points >= 0 ? points : width * height;
  if (height > 1 && width > 0 && width * height == layout.records) {
    layout.rows = static_cast<int>(height);
    layout.cols = static_cast<int>(width);
  }
  return layout;
}

Result<CloudLayout> parse_ply_header(std::string_view text, const std::string& name) {
  CloudLayout layout;
  const std::size_t all = text.size();
  bool in_vertex = false;
  bool first = true;  // no element yet
  bool format = false;
  for (;;) {
    if (text.empty()) return Error{name + ": no end_header: not a PLY file, or cut off"};
    const std::vector<std::string> line = words(next_line(&text));
    ++layout.header_lines;
    const auto wrong = [&](const char* what) {
      return Error{fmt::format("{}:{}: {}", name, layout.header_lines, what)};
    };
    if (layout.header_lines == 1) {
      if (line.size() != 1 || line[0] != "ply") return wrong("not a PLY file");
      continue;
    }
    if (line.empty() || line[0] == "comment" || line[0] == "obj_info") continue;
    if (line[0] == "end_header") break;
    if (line[0] == "format" && line.size() >= 2) {
      format = line[1] == "ascii" || line[1] == "binary_little_endian";
      if (!format) return wrong("only ascii and binary_little_endian are read");
      layout.ascii = line[1] == "ascii";
    } else if (line[0] == "element" && line.size() == 3) {
      in_vertex = line[1] == "vertex";
      if (first && !in_vertex) return wrong("the vertices must come first");
      if (first) {
        const std::optional<std::int64_t> number = whole(line[2]);
        if (!number) return wrong("number of vertices missing or invalid");
        layout.records = *number;
      }
      first = false;
    } else if (line[0] == "property" && line.size() >= 3) {
      if (!in_vertex) continue;
      const std::optional<Number> number = line.size() == 3 ? ply_number(line[1]) : std::nullopt;
      if (!number) return wrong("properties of a vertex must be numbers");
      layout.fields.push_back({line[2], *number});
    } else {
      return wrong("unknown keyword");
    }
  }
  if (!format) return Error{name + ": no format line"};
  layout.data_at = all - text.size();
  return layout;
}

Result<std::size_t> parse_columns(std::string_view line, const std::vector<std::size_t>& columns,
                                  std::vector<double>* out) {
  std::size_t column = 0;
  for (std::size_t i = 0; i < line.size();) {
    i = line.find_first_not_of(" \t,;", i);
    if (i == std::string_view::npos || line[i] == '#') break;
    const std::size_t end = std::min(line.find_first_of(" \t,;", i), line.size());
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (columns[k] != column) continue;
      if (!is_number(line.substr(i, end - i), &(*out)[k])) {
        return Error{fmt::format("\"{}\" is not a number", line.substr(i, end - i))};
      }
    }
    ++column;
    i = end;
  }
  return column;
}

}  // namespace rcs::clouds
