#include "tools/survey/survey_crs.h"

#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <cstring>
#include <string>
#include <vector>

#include "tools/survey/gdal_files.h"

namespace rcs::survey {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A TIFF of one black pixel in memory (TIFF 6.0), with a few tags.
class PixelTiff {
 public:
  PixelTiff() { directory_.reserve(kTags); }

  void add_number(std::uint16_t tag, std::uint32_t value) {
    constexpr std::uint16_t kLong = 4;
    Bytes bytes(4);
    std::memcpy(bytes.data(), &value, 4);
    directory_.push_back({tag, kLong, 1, bytes});
  }
  /// @param type  of TIFF, @param bytes  of each value
  void add_values(std::uint16_t tag, std::uint16_t type, std::size_t bytes, const Bytes& values) {
    const std::size_t count = values.size() / bytes;
    if (count == 0) return;
    Bytes whole(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count * bytes));
    directory_.push_back({tag, type, static_cast<std::uint32_t>(count), std::move(whole)});
  }
  /// Tags must have come in their order.
  [[nodiscard]] Bytes bytes() const {
    constexpr std::uint32_t kHead = 8;
    Bytes out = {'I', 'I', 42, 0};
    put(kHead, &out);
    put(static_cast<std::uint16_t>(directory_.size()), &out);
    auto data_at = static_cast<std::uint32_t>(kHead + 2 + 12 * directory_.size() + 4);
    Bytes data;
    for (const Entry& e : directory_) {
      put(e.tag, &out);
      put(e.type, &out);
      put(e.count, &out);
      Bytes value = e.value;
      if (value.size() > 4) {
        put(static_cast<std::uint32_t>(data_at + data.size()), &out);
        if (value.size() % 2 == 1) value.push_back(0);
        data.insert(data.end(), value.begin(), value.end());
      } else {
        value.resize(4);
        out.insert(out.end(), value.begin(), value.end());
      }
    }
    put(std::uint32_t{0}, &out);
    out.insert(out.end(), data.begin(), data.end());
    return out;
  }

 private:
  static constexpr std::size_t kTags = 16;
  struct Entry {
    std::uint16_t tag;
    std::uint16_t type;
    std::uint32_t count;
    Bytes value;
  };
  template <class T>
  static void put(T value, Bytes* out) {
    const std::size_t at = out->size();
    out->resize(at + sizeof value);
    std::memcpy(out->data() + at, &value, sizeof value);
  }
  std::vector<Entry> directory_;
};

Bytes tiff_of(const clouds::SurveyCrs& file) {
  constexpr std::uint16_t kShort = 3;
  constexpr std::uint16_t kDouble = 12;
  constexpr std::uint16_t kAscii = 2;
  PixelTiff tiff;
  tiff.add_number(256, 1);  // width
  tiff.add_number(257, 1);  // length
  tiff.add_number(258, 8);  // bits a sample
  tiff.add_number(259, 1);  // not compressed
  tiff.add_number(262, 1);  // black is 0
  tiff.add_number(273, 4);  // the pixel, at any byte that is there
  tiff.add_number(277, 1);  // samples a pixel
  tiff.add_number(278, 1);  // rows a strip
  tiff.add_number(279, 1);  // bytes in it
  tiff.add_values(34735, kShort, 2, file.geo_keys);
  tiff.add_values(34736, kDouble, 8, file.geo_doubles);
  Bytes ascii = file.geo_ascii;
  if (!ascii.empty()) ascii.back() = 0;
  tiff.add_values(34737, kAscii, 1, ascii);
  return tiff.bytes();
}

/// A file of GDAL in memory, for the lifetime of this object.
class MemoryFile {
 public:
  MemoryFile(const char* name, Bytes* bytes) : name_(name) {
    VSIFCloseL(VSIFileFromMemBuffer(name, bytes->data(), bytes->size(), FALSE));
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { VSIUnlink(name_); }

 private:
  const char* name_;
};

}  // namespace

Result<std::optional<OGRSpatialReference>> survey_crs(const clouds::SurveyCrs& file) {
  using Found = std::optional<OGRSpatialReference>;
  if (!file.wkt.empty()) {
    OGRSpatialReference crs;
    if (crs.importFromWkt(file.wkt.c_str()) != OGRERR_NONE) {
      return Error{"its coordinate reference system (WKT) can't be interpreted: use --crs"};
    }
    return Found(crs);
  }
  if (file.geo_keys.empty()) return Found();
  register_formats();
  constexpr const char* kName = "/vsimem/rcs_survey_crs.tif";
  Bytes bytes = tiff_of(file);
  const MemoryFile memory(kName, &bytes);
  // Else GDAL omits the vertical system.
  CPLSetThreadLocalConfigOption("GTIFF_REPORT_COMPD_CS", "YES");
  const char* const drivers[] = {"GTiff", nullptr};
  const Dataset tiff(
      GDALDataset::Open(kName, GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  const OGRSpatialReference* crs = tiff ? tiff->GetSpatialRef() : nullptr;
  const Found found = crs == nullptr || crs->IsEmpty() != 0 ? Found() : Found(*crs);
  CPLSetThreadLocalConfigOption("GTIFF_REPORT_COMPD_CS", nullptr);
  if (!found) {
    return Error{"its coordinate reference system (GeoTIFF keys) can't be interpreted: use --crs"};
  }
  return found;
}

}  // namespace rcs::survey
