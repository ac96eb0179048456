#pragma once
// LAS files for tests, valid or not.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace rcs::test {

struct LasPoint {
  double x = 0.0, y = 0.0, z = 0.0;
  int klass = 2;
  int number = 1;  ///< of
  int returns = 1;
  bool withheld = false;
};

struct LasRecord {
  std::string user = "LASF_Projection";
  int id = 2112;
  std::string body;
};

struct LasFile {
  int minor = 2;
  int format = 0;
  std::vector<LasPoint> points;
  std::vector<LasRecord> records;
  std::vector<LasRecord> extended;
  double offset[3] = {500000.0, 5200000.0, 0.0};
  double scale = 0.001;
  int encoding = 0;

  template <class T>
  static void put(std::size_t at, T value, std::string* out) {
    if (out->size() < at + sizeof value) out->resize(at + sizeof value, '\0');
    std::memcpy(out->data() + at, &value, sizeof value);
  }

  [[nodiscard]] std::string bytes() const {
    constexpr int kRecord[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    const std::size_t header = minor == 4 ? 375 : minor == 3 ? 235 : 227;
    std::string out(header, '\0');
    std::memcpy(out.data(), "LASF", 4);
    put(6, static_cast<std::uint16_t>(encoding), &out);
    out[24] = 1;
    out[25] = static_cast<char>(minor);
    put(94, static_cast<std::uint16_t>(header), &out);
    put(100, static_cast<std::uint32_t>(records.size()), &out);
    out[104] = static_cast<char>(format);
    const std::size_t length = static_cast<std::size_t>(kRecord[format]) + 2;  // and bytes of users
    put(105, static_cast<std::uint16_t>(length), &out);
    const auto count = static_cast<std::uint32_t>(points.size());
    put(107, format < 6 ? count : 0U, &out);
    for (std::size_t a = 0; a < 3; ++a) {
      put(131 + 8 * a, scale, &out);
      put(155 + 8 * a, offset[a], &out);
    }
    for (const LasRecord& r : records) append(r, false, &out);
    put(96, static_cast<std::uint32_t>(out.size()), &out);
    for (const LasPoint& p : points) {
      const std::size_t at = out.size();
      out.resize(at + length, '\0');
      const double v[3] = {p.x, p.y, p.z};
      for (std::size_t a = 0; a < 3; ++a) {
        put(at + 4 * a, static_cast<std::int32_t>(std::llround((v[a] - offset[a]) / scale)), &out);
      }
      const int held = p.withheld ? 1 : 0;
      if (format < 6) {
        out[at + 14] = static_cast<char>(p.number | p.returns << 3 | 0xC0);
        out[at + 15] = static_cast<char>(p.klass | 0x20 | held << 7);  // synthetic
      } else {
        out[at + 14] = static_cast<char>(p.number | p.returns << 4);
        out[at + 15] = static_cast<char>(0xC1 | held << 2);
        out[at + 16] = static_cast<char>(p.klass);
      }
    }
    if (minor == 4) {
      put(247, static_cast<std::uint64_t>(points.size()), &out);
      put(235, static_cast<std::uint64_t>(extended.empty() ? 0 : out.size()), &out);
      put(243, static_cast<std::uint32_t>(extended.size()), &out);
      for (const LasRecord& r : extended) append(r, true, &out);
    }
    return out;
  }

  static void append(const LasRecord& r, bool extended, std::string* out) {
    const std::size_t at = out->size();
    out->resize(at + (extended ? 60 : 54), '\0');
    std::memcpy(out->data() + at + 2, r.user.data(), r.user.size());
    put(at + 18, static_cast<std::uint16_t>(r.id), out);
    if (extended) {
      put(at + 20, static_cast<std::uint64_t>(r.body.size()), out);
    } else {
      put(at + 20, static_cast<std::uint16_t>(r.body.size()), out);
    }
    *out += r.body;
  }

  void write(const std::string& path) const { std::ofstream(path, std::ios::binary) << bytes(); }
};

}  // namespace rcs::test
