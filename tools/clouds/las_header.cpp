#include "tools/clouds/las_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <istream>
#include <limits>
#include <string_view>
#include <vector>

namespace rcs::clouds {
namespace {

constexpr std::int64_t kShortest = 227;  // header of 1.2
constexpr std::int64_t kLongest = 375;   // of 1.4
constexpr int kFormats = 11;
constexpr std::array<std::int64_t, kFormats> kRecordBytes = {20, 28, 26, 34, 57, 63,
                                                             30, 36, 38, 59, 67};

/// Offsets of the fields [bytes].
namespace field {
constexpr std::size_t kEncoding = 6;
constexpr std::size_t kMajor = 24;
constexpr std::size_t kMinor = 25;
constexpr std::size_t kHeaderSize = 94;
constexpr std::size_t kDataAt = 96;
constexpr std::size_t kRecords = 100;
constexpr std::size_t kFormat = 104;
constexpr std::size_t kRecordLength = 105;
constexpr std::size_t kLegacyPoints = 107;
constexpr std::size_t kScale = 131;
constexpr std::size_t kOffset = 155;
constexpr std::size_t kExtendedAt = 235;
constexpr std::size_t kExtended = 243;
constexpr std::size_t kPoints = 247;
}  // namespace field

template <class T>
T value_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  T v{};  // little endian, as the supported processors
  std::memcpy(&v, bytes.data() + at, sizeof v);
  return v;
}

class HeaderReader {
 public:
  HeaderReader(std::istream& in, std::int64_t size, const std::string& name)
      : in_(in), size_(size), name_(name) {}

  Result<LasHeader> read() {
    Outcome done = read_fixed();
    if (done) done = read_layout();
    if (done) done = read_count();
    if (done) done = read_scale();
    if (done) done = read_records();
    if (done) done = read_extended();
    if (!done) return done.error();
    choose_crs();
    return header_;
  }

 private:
  [[nodiscard]] Error wrong(const std::string& what) const { return Error{name_ + ": " + what}; }
  [[nodiscard]] Error compressed() const {
    return wrong(
        "compressed (LAZ): unpack it first, e.g. laszip -i in.laz -o out.las, or "
        "pdal translate in.laz out.las");
  }

  [[nodiscard]] Outcome bytes_at(std::int64_t at, std::int64_t count,
                                 std::vector<std::uint8_t>* out) {
    out->resize(static_cast<std::size_t>(count));
    in_.clear();
    in_.seekg(at);
    in_.read(reinterpret_cast<char*>(out->data()), count);
    if (in_.gcount() != count) return wrong("can't be read");
    return Done{};
  }

  [[nodiscard]] Outcome read_fixed() {
    if (size_ < kShortest) {
      return wrong(
          fmt::format("{} bytes: cut off in the header, which has {} at least", size_, kShortest));
    }
    if (Outcome read = bytes_at(0, std::min(size_, kLongest), &head_); !read) return read;
    if (std::memcmp(head_.data(), "LASF", 4) != 0) return wrong("not a LAS file (no LASF)");
    const int major = head_[field::kMajor];
    header_.minor = head_[field::kMinor];
    if (major != 1 || header_.minor < 2 || header_.minor > 4) {
      return wrong(fmt::format("version {}.{}: 1.2 to 1.4 are read", major, header_.minor));
    }
    return Done{};
  }

  [[nodiscard]] Outcome read_layout() {
    const std::int64_t least = header_.minor == 4 ? kLongest : header_.minor == 3 ? 235 : kShortest;
    const std::int64_t header_bytes = value_at<std::uint16_t>(head_, field::kHeaderSize);
    if (header_bytes < least || header_bytes > size_) {
      return wrong(fmt::format("header size {}: version 1.{} has {} at least, the file {} bytes",
                               header_bytes, header_.minor, least, size_));
    }
    header_.data_at = value_at<std::uint32_t>(head_, field::kDataAt);
    if (header_.data_at < header_bytes || header_.data_at > size_) {
      return wrong(
          fmt::format("offset to point data {}: allowed are {} (the header) to {} (the "
                      "file) bytes",
                      header_.data_at, header_bytes, size_));
    }
    records_at_ = header_bytes;
    constexpr int kCompressed = 0xC0;  // LASzip sets the highest bit, or the one below it
    const int format = head_[field::kFormat];
    if ((format & kCompressed) != 0) return compressed();
    const int last_format = header_.minor == 2 ? 3 : header_.minor == 3 ? 5 : kFormats - 1;
    if (format > last_format) {
      return wrong(fmt::format("point data format {}: version 1.{} has 0 to {}", format,
                               header_.minor, last_format));
    }
    header_.format = format;
    header_.record_bytes = value_at<std::uint16_t>(head_, field::kRecordLength);
    const std::int64_t due = kRecordBytes[static_cast<std::size_t>(format)];
    if (header_.record_bytes < due) {
      return wrong(fmt::format("point record length {}: format {} has {} at least",
                               header_.record_bytes, format, due));
    }
    return Done{};
  }

  [[nodiscard]] Outcome read_count() {
    std::uint64_t points = value_at<std::uint32_t>(head_, field::kLegacyPoints);
    if (header_.minor == 4) {
      const auto all = value_at<std::uint64_t>(head_, field::kPoints);
      if (points != 0 && all != 0 && points != all) {
        return wrong(fmt::format("number of points {}: the legacy field says {}", all, points));
      }
      points = std::max(points, all);
    }
    const std::int64_t room = (size_ - header_.data_at) / header_.record_bytes;
    if (points > static_cast<std::uint64_t>(room)) {
      return wrong(
          fmt::format("number of points {}: the file has room for {} (cut off?)", points, room));
    }
    if (points == 0) return wrong("number of points 0");
    header_.points = static_cast<std::int64_t>(points);
    return Done{};
  }

  [[nodiscard]] Outcome read_scale() {
    constexpr std::array<const char*, 3> kAxes = {"X", "Y", "Z"};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto scale = value_at<double>(head_, field::kScale + 8 * a);
      const auto offset = value_at<double>(head_, field::kOffset + 8 * a);
      if (!(scale > 0.0 && scale <= 1e3)) {
        return wrong(
            fmt::format("{} scale factor {}: allowed are those above 0 to 1000", kAxes[a], scale));
      }
      if (!(std::abs(offset) <= 1e9)) {
        return wrong(fmt::format("{} offset {}: allowed are -1e9 to 1e9", kAxes[a], offset));
      }
      header_.scale[a] = scale;
      header_.offset[a] = offset;
    }
    return Done{};
  }

  /// A record of variable length: its header has the size as u16 (54 bytes) or u64 (60 bytes).
  [[nodiscard]] Outcome take_record(bool extended, std::uint32_t number, std::int64_t end,
                                    std::int64_t* at) {
    const std::int64_t head_bytes = extended ? 60 : 54;
    const char* const kind =
        extended ? "extended variable length record" : "variable length record";
    if (end - *at < head_bytes) {
      return wrong(fmt::format(
          "{} {} of {}: begins at byte {}, must end by {}", kind, number + 1,
          value_at<std::uint32_t>(head_, extended ? field::kExtended : field::kRecords), *at, end));
    }
    std::vector<std::uint8_t> record;
    if (Outcome read = bytes_at(*at, head_bytes, &record); !read) return read;
    const std::uint64_t length =
        extended ? value_at<std::uint64_t>(record, 20) : value_at<std::uint16_t>(record, 20);
    if (length > static_cast<std::uint64_t>(end - *at - head_bytes)) {
      return wrong(
          fmt::format("{} {}: its length {} goes beyond byte {}", kind, number + 1, length, end));
    }
    std::string user(reinterpret_cast<const char*>(record.data()) + 2, 16);
    user.resize(std::min(user.size(), user.find('\0')));
    const int id = value_at<std::uint16_t>(record, 18);
    const std::int64_t body_at = *at + head_bytes;
    *at = body_at + static_cast<std::int64_t>(length);
    if (user == "laszip encoded") return compressed();
    if (user != "LASF_Projection") return Done{};
    constexpr std::uint64_t kMax = 1U << 20U;
    constexpr int kWkt = 2112;
    constexpr int kKeys = 34735;
    if (id != kWkt && (id < kKeys || id > kKeys + 2)) return Done{};
    if (length > kMax) {
      return wrong(fmt::format("{} {}: {} bytes of coordinate reference system, allowed {}", kind,
                               number + 1, length, kMax));
    }
    std::vector<std::uint8_t> body;
    if (Outcome read = bytes_at(body_at, static_cast<std::int64_t>(length), &body); !read) {
      return read;
    }
    if (id == kWkt) {
      const std::string text(body.begin(), std::find(body.begin(), body.end(), 0));
      if (header_.crs.wkt.empty()) header_.crs.wkt = text;
    } else if (id == kKeys) {
      header_.crs.geo_keys = std::move(body);
    } else {
      (id == kKeys + 1 ? header_.crs.geo_doubles : header_.crs.geo_ascii) = std::move(body);
    }
    return Done{};
  }

  [[nodiscard]] Outcome read_records() {
    const auto count = value_at<std::uint32_t>(head_, field::kRecords);
    std::int64_t at = records_at_;
    for (std::uint32_t k = 0; k < count; ++k) {
      if (Outcome taken = take_record(false, k, header_.data_at, &at); !taken) return taken;
    }
    return Done{};
  }

  [[nodiscard]] Outcome read_extended() {
    if (header_.minor < 4) return Done{};
    const auto count = value_at<std::uint32_t>(head_, field::kExtended);
    if (count == 0) return Done{};
    const auto begin = value_at<std::uint64_t>(head_, field::kExtendedAt);
    const std::int64_t data_end = header_.data_at + header_.points * header_.record_bytes;
    if (begin < static_cast<std::uint64_t>(data_end) || begin > static_cast<std::uint64_t>(size_)) {
      return wrong(
          fmt::format("start of extended variable length records {}: allowed are {} (the "
                      "points' end) to {} (the file's)",
                      begin, data_end, size_));
    }
    auto at = static_cast<std::int64_t>(begin);
    for (std::uint32_t k = 0; k < count; ++k) {
      if (Outcome taken = take_record(true, k, size_, &at); !taken) return taken;
    }
    return Done{};
  }

  /// A file may have both: a bit selects the valid one.
  void choose_crs() {
    constexpr unsigned kSaysWkt = 0x10;
    const bool says_wkt = (value_at<std::uint16_t>(head_, field::kEncoding) & kSaysWkt) != 0;
    if (header_.crs.wkt.empty() || header_.crs.geo_keys.empty()) return;
    if (says_wkt) {
      header_.crs.geo_keys.clear();
    } else {
      header_.crs.wkt.clear();
    }
  }

  std::istream& in_;
  std::int64_t size_;
  const std::string& name_;
  std::vector<std::uint8_t> head_;
  std::int64_t records_at_ = 0;
  LasHeader header_;
};

}  // namespace

Result<LasHeader> read_las_header(std::istream& in, std::int64_t size, const std::string& name) {
  return HeaderReader(in, size, name).read();
}

}  // namespace rcs::clouds
