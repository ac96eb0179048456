#pragma once
// A pair of scans for the figures of the paper: registered from one initial pose by the method of
// the paper, corrected, and by plane (register_clouds()).

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "tools/report/match_picture.h"
#include "tools/studies/cloud_match.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::studies {

inline constexpr const char* kPaperMethod = "paper, corrected";
inline constexpr const char* kPlaneMethod = "plane";

/// The data at a pose: before, or after a method.
struct PlacedData {
  std::string name;                               ///< "before", "after (plane)"
  report::Colour colour = report::Colour::kBlue;  ///< of its distances
  Pose T_model_data;
  Points data_model;
  std::vector<float> distance_m;  ///< of each data point to its closest model point

  [[nodiscard]] double mean_cm() const;
  [[nodiscard]] double median_cm() const;
};

struct MethodResult {
  std::string method;
  CloudMatch match;
  Offset error;  ///< against the true motion
  PlacedData after;

  [[nodiscard]] const char* verdict() const { return match.good ? "accepted" : "rejected"; }
  /// One sentence with the values, without its full stop.
  [[nodiscard]] std::string text() const;
};

struct FigurePair {
  Trial trial;
  Points model;
  Points data;
  PlacedData before;
  std::vector<MethodResult> methods;  ///< kPaperMethod, kPlaneMethod
  report::MatchView view;  ///< of the dense parts; detail: where both scans have most structure
  report::Window pairs_window;  ///< a smaller one, for single pairs
};

/// The scans of the trial are not empty.
[[nodiscard]] FigurePair register_for_figures(const ScanSet& scans, const Trial& trial);

/// The search for closest points in the middle of the iterations of the paper's method.
struct MidwaySearch {
  std::size_t iteration = 0;  ///< iterations before it
  std::size_t iterations = 0;
  double d_max_m = 0.0;  ///< a pair is accepted within it
  Points data_model;
  std::vector<std::uint32_t> closest;  ///< model point of each data point
  std::vector<float> distance_m;
};
/// Empty if the method has not iterated.
[[nodiscard]] MidwaySearch search_midway(const FigurePair& pair);

}  // namespace rcs::studies
