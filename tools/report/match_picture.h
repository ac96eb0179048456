#pragma once
// Plots of a registration, as figures 2 and 3 of the paper (Madhavan and Messina): the model, the
// registered data, the closest model point of each data point, and the distances between them.

#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "tools/report/svg_plot.h"

namespace rcs::report {

/// The windows of the plots, the same before and after for comparison.
struct MatchView {
  Window above;   ///< x, y in the frame of the model [m]
  Window side;    ///< x, z
  Window detail;  ///< x, y: a few metres in the middle of the data
};

/// The axes of a picture: x and y, or x and z.
enum class Projection { kAbove = 1, kSide = 2 };

/// The points of a cloud, of a large cloud every n-th.
/// @param T_picture_cloud  to the frame of the picture
[[nodiscard]] Series cloud_dots(const std::string& label, Colour colour, const Points& points,
                                const Pose& T_picture_cloud, Projection projection);

/// Windows of the dense parts of model and data, without strays.
[[nodiscard]] MatchView view_of(const Points& model, const Points& data, const Pose& guess,
                                const Pose& answer);

/// An SVG file: from above, from the side, and a magnified part with the pairs.
/// @param closest  index of the closest model point of each data point
[[nodiscard]] std::string match_picture(const std::string& title, const Points& model,
                                        const Points& data, const Pose& T_model_data,
                                        const std::vector<std::uint32_t>& closest,
                                        const MatchView& view);

/// Distances of the data points to their closest model points, at a pose.
struct NamedDistances {
  std::string name;  ///< of the pose
  Colour colour = Colour::kBlue;
  std::vector<float> distance_m;
};

/// Histogram of the distances up to `max_m`, in common bins.
/// @param max_m  above 0
[[nodiscard]] Plot distance_histogram(const std::vector<NamedDistances>& poses, double max_m);
/// The same before and after a registration.
[[nodiscard]] Plot distance_histogram(const std::vector<float>& before_m,
                                      const std::vector<float>& after_m);

}  // namespace rcs::report
