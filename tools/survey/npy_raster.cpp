#include "tools/survey/npy_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "rcs/base/byte_codec.h"
#include "tools/base/files.h"

namespace rcs::survey {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxValues = std::int64_t{1} << 28;

/// IEEE 754 binary16.
float from_half(std::uint16_t h) {
  const int exponent = (h >> 10) & 0x1F;
  const int fraction = h & 0x3FF;
  float value = 0.0F;
  if (exponent == 0x1F) {
    value = fraction == 0 ? std::numeric_limits<float>::infinity()
                          : std::numeric_limits<float>::quiet_NaN();
  } else if (exponent == 0) {
    value = std::ldexp(static_cast<float>(fraction), -24);
  } else {
    value = std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
  }
  return (h & 0x8000) != 0 ? -value : value;
}

/// The only file of a folder with `part` in its name, followed by `behind` characters; nullopt:
/// none or several.
std::optional<std::string> only_file(const std::string& folder, std::string_view part,
                                     std::size_t behind) {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const std::size_t at = name.rfind(part);
    if (at != std::string::npos && at + part.size() + behind == name.size()) {
      found.push_back(entry.path().string());
    }
  }
  return found.size() == 1 ? std::optional<std::string>(found.front()) : std::nullopt;
}

/// The text after "'key':" in the header of an array, without leading blanks; nullopt: no such key.
std::optional<std::string_view> value_of(std::string_view header, std::string_view key) {
  const std::string quoted = fmt::format("'{}':", key);
  const std::size_t at = header.find(quoted);
  if (at == std::string_view::npos) return std::nullopt;
  header.remove_prefix(at + quoted.size());
  header.remove_prefix(std::min(header.find_first_not_of(' '), header.size()));
  return header;
}

/// Parses "(rows, cols)" at the begin of the text.
std::optional<std::array<int, 2>> shape_of(std::string_view text) {
  std::array<int, 2> shape{};
  const auto skip = [&text](std::string_view what) {
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    const bool found = text.substr(0, what.size()) == what;
    if (found) text.remove_prefix(what.size());
    return found;
  };
  const auto number = [&](int* n) {
    (void)skip("");
    const std::from_chars_result r = std::from_chars(text.data(), text.data() + text.size(), *n);
    text.remove_prefix(static_cast<std::size_t>(r.ptr - text.data()));
    return r.ec == std::errc() && *n >= 0;
  };
  if (!skip("(") || !number(&shape[0]) || !skip(",") || !number(&shape[1])) return std::nullopt;
  (void)skip(",");
  return skip(")") ? std::optional(shape) : std::nullopt;
}

/// The cities and the origins of their frames (values of the AV2 API).
struct City {
  const char* name;
  double lat_deg, lon_deg;
};
constexpr City kCities[] = {
    {"ATX", 30.27464237939507, -97.7404457407424},  {"DTW", 42.29993066912924, -83.17555750783717},
    {"MIA", 25.77452579915163, -80.19656914449405}, {"PAO", 37.416065, -122.13571963362166},
    {"PIT", 40.44177902989321, -80.01294377242584}, {"WDC", 38.889377, -77.0355047439081},
};

/// float16 rounds heights of 32 to 64 m to 3 cm, above to 6 cm: terraces that would disturb a
/// match. Computes the smoothest surface that rounds to the stored values, by relaxation.
void undo_rounding(Raster* r) {
  constexpr int kPasses = 50;
  constexpr int kFractionBits = 10;
  const std::vector<float> stored = r->z_m;
  std::vector<float> before;
  for (int pass = 0; pass < kPasses; ++pass) {
    before = r->z_m;
    for (int j = 0; j < r->height; ++j) {
      for (int i = 0; i < r->width; ++i) {
        const Cell here{r->first.i + i, r->first.j + j};
        const std::size_t k = r->at(here);
        if (std::isnan(stored[k]) || stored[k] == 0.0F) continue;
        float sum = 0.0F;
        int n = 0;
        for (const Cell neighbour : {Cell{here.i + 1, here.j}, Cell{here.i - 1, here.j},
                                     Cell{here.i, here.j + 1}, Cell{here.i, here.j - 1}}) {
          if (!r->contains(neighbour) || std::isnan(before[r->at(neighbour)])) continue;
          sum += before[r->at(neighbour)];
          ++n;
        }
        const float half = std::ldexp(0.5F, std::ilogb(stored[k]) - kFractionBits);
        if (n > 0) {
          r->z_m[k] = std::clamp(sum / static_cast<float>(n), stored[k] - half, stored[k] + half);
        }
      }
    }
  }
}

}  // namespace

Result<NpyArray> parse_npy(const std::vector<std::uint8_t>& bytes, const std::string& name) {
  constexpr char kMagic[] = "\x93NUMPY";
  const auto bad = [&name](const std::string& why) { return Error{name + ": " + why}; };
  if (bytes.size() < 12 || std::memcmp(bytes.data(), kMagic, 6) != 0) {
    return bad("not a .npy array (magic)");
  }
  const int version = bytes[6];
  if (version < 1 || version > 3) return bad(fmt::format("version {}, known are 1 to 3", version));
  const std::size_t at = version == 1 ? 10 : 12;
  const std::size_t length = version == 1 ? wire::take<std::uint16_t>(bytes.data() + 8)
                                          : wire::take<std::uint32_t>(bytes.data() + 8);
  if (length > bytes.size() - at) return bad("truncated in its header");
  const std::string_view header(reinterpret_cast<const char*>(bytes.data()) + at, length);
  const std::string_view type = value_of(header, "descr").value_or("").substr(0, 5);
  if (type != "'<f2'" && type != "'<f4'" && type != "'<f8'") {
    return bad("its values are not float16, float32 or float64, little-endian");
  }
  if (value_of(header, "fortran_order").value_or("").substr(0, 5) != "False") {
    return bad("not in C order");
  }
  const std::optional<std::array<int, 2>> shape = shape_of(value_of(header, "shape").value_or(""));
  if (!shape) return bad("not of two dimensions");
  const auto size = static_cast<std::size_t>(type[3] - '0');
  NpyArray array;
  array.half = size == 2;
  array.rows = (*shape)[0];
  array.cols = (*shape)[1];
  const std::int64_t n = std::int64_t{array.rows} * array.cols;
  if (n < 1 || n > kMaxValues) return bad(fmt::format("{} values, allowed 1 to 2^28", n));
  if (static_cast<std::size_t>(n) * size != bytes.size() - at - length) {
    return bad(fmt::format("expected {} x {} values of {} bytes, found {} bytes", array.rows,
                           array.cols, size, bytes.size() - at - length));
  }
  array.values.reserve(static_cast<std::size_t>(n));
  const std::uint8_t* in = bytes.data() + at + length;
  for (std::int64_t k = 0; k < n; ++k, in += size) {
    array.values.push_back(size == 2   ? from_half(wire::take<std::uint16_t>(in))
                           : size == 4 ? wire::take<float>(in)
                                       : static_cast<float>(wire::take<double>(in)));
  }
  return array;
}

Result<ImportedRaster> import_av2(const std::string& folder, const SurveyQuality& quality) {
  const std::string map = fs::exists(folder + "/map") ? folder + "/map" : folder;
  constexpr std::string_view kCityNpy = "CTY.npy";
  const std::optional<std::string> npy =
      only_file(map, "ground_height_surface____", kCityNpy.size());
  const std::optional<std::string> json = only_file(map, "img_Sim2_city.json", 0);
  if (!npy || !json) {
    return Error{map +
                 ": expected one *ground_height_surface____CITY.npy and one *img_Sim2_city.json"};
  }
  const Result<std::vector<std::uint8_t>> bytes = tools::read_bytes(*npy);
  if (!bytes) return bytes.error();
  const Result<NpyArray> array = parse_npy(*bytes, *npy);
  if (!array) return array.error();
  const Result<std::string> text = tools::read_text(*json);
  if (!text) return text.error();
  const nlohmann::json sim2 = nlohmann::json::parse(*text, nullptr, false);
  double scale = 0.0;
  std::vector<double> t;
  std::vector<double> R;
  try {
    sim2.at("s").get_to(scale);
    sim2.at("t").get_to(t);
    sim2.at("R").get_to(R);
  } catch (const nlohmann::json::exception&) {
    return Error{*json + ": expected numbers s, t and R"};
  }
  if (!(scale > 1e-4 && scale < 100.0) || t.size() != 2 ||
      R != std::vector<double>{1.0, 0.0, 0.0, 1.0}) {
    return Error{*json + ": expected s in (1e-4, 100), t with two numbers and R without rotation"};
  }

  const std::string name = npy->substr(npy->size() - kCityNpy.size(), 3);
  const auto* const city = std::find_if(std::begin(kCities), std::end(kCities),
                                        [&](const City& c) { return name == c.name; });
  if (city == std::end(kCities)) return Error{*npy + ": unknown city: " + name};

  ImportedRaster out;
  out.frame.datum = {radians(city->lat_deg), radians(city->lon_deg), {0.0}};
  out.frame.reference = "AV2-" + name;
  out.frame.heights = out.frame.reference;
  out.frame.source_crs = "Argoverse 2 city frame " + name;
  Raster& r = out.raster;
  r.level = {1.0 / scale, Vec2(-t[0], -t[1]), quality.bias_sigma_m, quality.bias_correlation_m};
  r.width = array->cols;
  r.height = array->rows;
  r.z_m = array->values;
  for (float& z : r.z_m) {
    if (!std::isfinite(z)) z = std::numeric_limits<float>::quiet_NaN();
  }
  if (array->half) undo_rounding(&r);
  r.sigma_m = {static_cast<float>(quality.sigma_m)};
  r.count = {1};
  r.date = {static_cast<std::uint16_t>(quality.date)};
  r.source = {CellSource::kSurvey};
  if (Outcome checked = check_raster(r); !checked) {
    return Error{*npy + ": " + checked.error().message};
  }
  return out;
}

}  // namespace rcs::survey
