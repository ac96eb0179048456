#pragma once
// Common functions for GDAL: files that are closed, and error messages.

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

/// Registers only the formats of kRasterFormats and those that are written with GDAL: no virtual
/// rasters, which read any file that they name, and no drivers that read from a network.
void register_formats();

struct CloseDataset {
  void operator()(GDALDataset* d) const { GDALClose(d); }
};
using Dataset = std::unique_ptr<GDALDataset, CloseDataset>;

/// Keeps messages of GDAL from stderr, for use in errors.
class QuietGdal {
 public:
  QuietGdal() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

/// Reason of the failure of the last call of GDAL.
[[nodiscard]] inline std::string gdal_says() {
  constexpr std::size_t kMax = 200;  // it may quote the whole header of a file
  std::string text = CPLGetLastErrorMsg();
  if (text.size() > kMax) text = text.substr(0, kMax) + "...";
  return text.empty() ? "GDAL gives no reason" : text;
}

/// Drivers write to memory: not all of them report a full disk, and some remove an existing file
/// with the name of the output.
inline constexpr char kInMemory[] = "/vsimem/rcs_output";

/// Moves the output of a driver at kInMemory to a file.
[[nodiscard]] inline Outcome close_and_write(Dataset written, const std::string& path) {
  const bool created = written != nullptr;
  written.reset();  // flushes the rest
  vsi_l_offset bytes = 0;
  const std::unique_ptr<GByte, decltype(&VSIFree)> file(VSIGetMemFileBuffer(kInMemory, &bytes, 1),
                                                        &VSIFree);
  VSIUnlink((std::string(kInMemory) + ".aux.xml").c_str());  // metadata that the format can't store
  if (!created || !file || CPLGetLastErrorType() >= CE_Failure) {
    return Error{path + ": " + gdal_says()};
  }
  return tools::write_text(path, {reinterpret_cast<const char*>(file.get()), bytes});
}

}  // namespace rcs::survey
