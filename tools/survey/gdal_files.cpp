#include "tools/survey/gdal_files.h"

#include <cpl_conv.h>
#include <gdal_frmts.h>
#include <ogr_srs_api.h>

namespace rcs::survey {

void register_formats() {
  // GDALAllRegister() would add formats that name other files and servers.
  GDALRegister_GTiff();
  GDALRegister_AAIGrid();
  GDALRegister_EHdr();
  GDALRegister_ENVI();
  GDALRegister_SRTMHGT();
  GDALRegister_DTED();
  GDALRegister_USGSDEM();
  GDALRegister_GSAG();
  GDALRegister_GSBG();
  GDALRegister_GS7BG();
  GDALRegister_MEM();
  GDALRegister_PNG();
  // A GeoTIFF may name an overview, and a coordinate reference system a grid, at a server.
  CPLSetConfigOption("CPL_VSIL_CURL_ALLOWED_FILENAME", "none");
  OSRSetPROJEnableNetwork(0);
}

}  // namespace rcs::survey
