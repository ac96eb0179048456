#pragma once
// The a priori map of an Argoverse 2 log: the height of the ground as a NumPy array, and the
// similarity transform to the frame of the city.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::survey {

/// A two-dimensional array of .npy, row by row.
struct NpyArray {
  int rows = 0;
  int cols = 0;
  bool half = false;  ///< of float16
  std::vector<float> values;
};

/// Versions 1 to 3; float16, float32 and float64, little-endian, in C order.
/// @param name  for errors
[[nodiscard]] Result<NpyArray> parse_npy(const std::vector<std::uint8_t>& bytes,
                                         const std::string& name);

struct ImportedRaster {
  MapFrame frame;
  Raster raster;
};

/// Accuracy of the heights of the survey.
struct SurveyQuality {
  double sigma_m = 0.05;             ///< of a height, without the systematic error, (0, 1000]
  double bias_sigma_m = 0.0;         ///< [0, 1000]
  double bias_correlation_m = 1000;  ///< (0, 1e7]
  int date = 0;                      ///< days since 2000-01-01; 0: unknown
};

/// @param folder  of a log, or its folder `map`: *_ground_height_surface____CITY.npy and
///   *___img_Sim2_city.json
/// @return in the frame of the city, with the axes of its UTM grid and a local height datum;
///   reference and heights are named after the city
[[nodiscard]] Result<ImportedRaster> import_av2(const std::string& folder,
                                                const SurveyQuality& quality);

}  // namespace rcs::survey
