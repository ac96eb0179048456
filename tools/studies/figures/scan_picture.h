#pragma once
// Parts of the pictures of a registration: the range image, the vehicle below its LADAR, and the
// magnified part of two scans.

#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "tools/report/match_picture.h"
#include "tools/report/svg_plot.h"

namespace rcs::studies {

/// The cells of a range image, in the frame of its points.
struct ImageShape {
  int rows = 0;  ///< row 0 is the lowest
  int cols = 0;  ///< column 0 is at the left
  double left_rad = 0.0;
  double width_rad = 0.0;
  double lowest_rad = 0.0;
  double height_rad = 0.0;
};

struct RangeLimits {
  double low_m = 0.0;
  double high_m = 0.0;
};

/// Ranges that both range images contain, so that both have the same colours. Equal limits if there
/// are none.
[[nodiscard]] RangeLimits common_limits(const Points& a, const Points& b, const ImageShape& shape);

/// The range image of a scan: rows and columns, coloured by the logarithm of the range. A cell has
/// its nearest return; an empty one has none. Ranges outside of the limits have the colour of the
/// limit.
[[nodiscard]] report::Plot range_image(const std::string& title, const Points& points_ladar,
                                       const ImageShape& shape, const RangeLimits& limits);

/// Outline of a vehicle in the frame of its axes: x forward, z up [m].
struct VehicleShape {
  Pose T_ladar_vehicle;
  double front = 0.0;  ///< x
  double rear = 0.0;
  double half_width = 0.0;
  double roof = 0.0;  ///< z
  double ground = 0.0;
  double front_axle = 0.0;  ///< x
  double rear_axle = 0.0;
};

/// The outline with a mark at the front, or from the side with its wheels.
[[nodiscard]] report::Series vehicle_outline(const std::string& label, report::Colour colour,
                                             const VehicleShape& vehicle,
                                             const Pose& T_picture_ladar,
                                             report::Projection projection);

/// Lines from each point of `from` to the one of `to` with the same index.
/// @param from, to  of one size, in the frame of the picture; of many pairs every n-th is shown
[[nodiscard]] report::Series pair_lines(const std::string& label, report::Colour colour,
                                        const Points& from, const Points& to,
                                        report::Projection projection);

/// Points as dots larger than those of a cloud, without an entry in the legend.
[[nodiscard]] report::Series big_dots(report::Colour colour, const Points& points,
                                      report::Projection projection);

[[nodiscard]] Points moved(const Points& points, const Pose& T_picture_points);
/// In x and y.
[[nodiscard]] bool inside(const report::Window& window, const Vec3f& point);
[[nodiscard]] Points inside(const report::Window& window, const Points& points);

/// The window in x and y of a given size in which both clouds have the most structure above the
/// ground at the same places; without any structure, the most ground.
/// @param a, b  in one frame
[[nodiscard]] report::Window detail_window(const Points& a, const Points& b, double width_m,
                                           double height_m);

}  // namespace rcs::studies
