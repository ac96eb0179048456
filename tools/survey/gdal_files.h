#pragma once
// What all that is done with GDAL needs: files that close, messages that are ours.

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <gdal.h>
#include <gdal_priv.h>

#include <memory>
#include <string>

#include "rcs/base/result.h"
#include "tools/base/files.h"

namespace rcs::survey {

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

/// Drivers write to memory: not all of them tell when a disk is full, and some remove what has the
/// output's name.
inline constexpr char kInMemory[] = "/vsimem/rcs_output";

/// Moves what a driver made at kInMemory to a file.
[[nodiscard]] inline Outcome close_and_write(Dataset written, const std::string& path) {
  const bool created = written != nullptr;
  written.reset();  // the last of it is written now
  vsi_l_offset bytes = 0;
  const std::unique_ptr<GByte, decltype(&VSIFree)> file(VSIGetMemFileBuffer(kInMemory, &bytes, 1),
                                                        &VSIFree);
  VSIUnlink((std::string(kInMemory) + ".aux.xml").c_str());  // what the format can't say
  if (!created || !file || CPLGetLastErrorType() >= CE_Failure) {
    return Error{path + ": " + gdal_says()};
  }
  return tools::write_text(path, {reinterpret_cast<const char*>(file.get()), bytes});
}

}  // namespace rcs::survey
