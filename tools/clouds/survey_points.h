#pragma once
// A survey's points, read from its file block by block: as many as there are, in little memory.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::clouds {

constexpr std::int16_t kNoClass = -1;

/// Points of equal number in each array.
struct SurveyPoints {
  std::vector<double> x, y, z;        ///< as the file has them, scale and offset applied
  std::vector<std::int16_t> klass;    ///< the ASPRS's numbers, [0, 255]; kNoClass: it has none
  std::vector<std::uint8_t> last;     ///< 1: of its pulse's returns, or the file does not say
  std::vector<std::uint8_t> invalid;  ///< 1: withheld by who made the file, or not finite

  [[nodiscard]] std::size_t size() const { return x.size(); }
  void clear();
  void add(double px, double py, double pz, std::int16_t its_class, bool is_last, bool is_invalid);
};

/// What a file says of its coordinates.
struct SurveyCrs {
  std::string wkt;  ///< empty: none
  /// GeoTIFF's keys and their values; empty: none.
  std::vector<std::uint8_t> geo_keys, geo_doubles, geo_ascii;
};

class SurveyPointFile {
 public:
  SurveyPointFile() = default;
  SurveyPointFile(const SurveyPointFile&) = delete;
  SurveyPointFile& operator=(const SurveyPointFile&) = delete;
  virtual ~SurveyPointFile() = default;

  [[nodiscard]] virtual const SurveyCrs& crs() const = 0;
  /// Begins again with the first point.
  [[nodiscard]] virtual Outcome rewind() = 0;
  /// The next points, at most 65536, instead of those in `out`; none: that was all.
  [[nodiscard]] virtual Outcome next(SurveyPoints* out) = 0;
};

/// @param path  ends in .las, .xyz, .txt, .pcd or .ply; errors begin with it
/// @param class_column  of .xyz and .txt, counted from 1, [4, 100]; 0: none
[[nodiscard]] Result<std::unique_ptr<SurveyPointFile>> open_survey_points(const std::string& path,
                                                                          int class_column);

}  // namespace rcs::clouds
