#pragma once
// Reads the points of a survey from its file block by block, in little memory.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::clouds {

constexpr std::int16_t kNoClass = -1;

/// Points; all arrays have the same length.
struct SurveyPoints {
  std::vector<double> x, y, z;        ///< in the coordinates of the file, scale and offset applied
  std::vector<std::int16_t> klass;    ///< ASPRS class, [0, 255]; kNoClass: none
  std::vector<std::uint8_t> last;     ///< 1: last return of its pulse, or unknown
  std::vector<std::uint8_t> invalid;  ///< 1: flagged as withheld in the file, or not finite

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void clear();
  void add(double px, double py, double pz, std::int16_t its_class, bool is_last, bool is_invalid);
};

/// Coordinate reference system in a file.
struct SurveyCrs {
  std::string wkt;  ///< empty: none
  /// GeoTIFF keys and their values; empty: none.
  std::vector<std::uint8_t> geo_keys, geo_doubles, geo_ascii;
};

class SurveyPointFile {
 public:
  SurveyPointFile() = default;
  SurveyPointFile(const SurveyPointFile&) = delete;
  SurveyPointFile& operator=(const SurveyPointFile&) = delete;
  virtual ~SurveyPointFile() = default;

  [[nodiscard]] virtual const SurveyCrs& crs() const = 0;
  /// Restarts with the first point.
  [[nodiscard]] virtual Outcome rewind() = 0;
  /// Replaces `out` by the next points, at most 65536; empty at the end.
  [[nodiscard]] virtual Outcome next(SurveyPoints* out) = 0;
};

/// @param path  ends in .las, .xyz, .txt, .pcd or .ply; errors begin with it
/// @param class_column  of .xyz and .txt, counted from 1, [4, 100]; 0: none
[[nodiscard]] Result<std::unique_ptr<SurveyPointFile>> open_survey_points(const std::string& path,
                                                                          int class_column);

}  // namespace rcs::clouds
