#pragma once
// Pictures of a registration, as figures 2 and 3 of the paper (Madhavan and Messina): the model,
// the data on it, each data point's closest model point, and the distances between them.

#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "tools/report/svg_plot.h"

namespace rcs::report {

/// What is shown, the same before and after so that the two can be compared.
struct MatchView {
  Window above;   ///< x, y of the model's frame [m]
  Window side;    ///< x, z
  Window detail;  ///< x, y: a few metres in the middle of the data
};

/// Model and data where they are dense: strays do not make the picture small.
[[nodiscard]] MatchView view_of(const Points& model, const Points& data, const Pose& guess,
                                const Pose& answer);

/// An SVG file: from above, from the side, and a magnified part with the pairs.
/// @param closest  the index of each data point's closest model point
[[nodiscard]] std::string match_picture(const std::string& title, const Points& model,
                                        const Points& data, const Pose& T_model_data,
                                        const std::vector<std::uint32_t>& closest,
                                        const MatchView& view);

/// How many data points are how far from their closest model point.
[[nodiscard]] Plot distance_histogram(const std::vector<float>& before_m,
                                      const std::vector<float>& after_m);

}  // namespace rcs::report
