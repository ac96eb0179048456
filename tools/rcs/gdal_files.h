#pragma once
// What all that is done with GDAL needs: files that close, messages that are ours.

#include <cpl_error.h>
#include <gdal.h>
#include <gdal_priv.h>

#include <memory>
#include <string>

namespace rcs::tools {

/// Registers the formats of kRasterFormats and those that are written with GDAL, and no other:
/// neither virtual rasters, which read any file that they name, nor anything that reads from a
/// network.
void register_formats();

struct CloseDataset {
  void operator()(GDALDataset* d) const { GDALClose(d); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

/// GDAL's own messages go into ours, not to stderr.
class QuietGdal {
 public:
  QuietGdal() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

/// Why GDAL's last call failed.
[[nodiscard]] inline std::string gdal_says() {
  constexpr std::size_t kMost = 200;  // it may quote a file's whole head
  std::string text = CPLGetLastErrorMsg();
  if (text.size() > kMost) text = text.substr(0, kMost) + "...";
  return text.empty() ? "GDAL does not say why" : text;
}

}  // namespace rcs::tools
