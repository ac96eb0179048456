#pragma once
// The plots of the figures of the paper, of a pair of scans.

#include <string>
#include <vector>

#include "tools/report/svg_plot.h"
#include "tools/studies/figures/figure_pair.h"
#include "tools/studies/figures/scan_picture.h"

namespace rcs::studies {

class FigurePanels {
 public:
  /// @param name  begin of the titles, which are unique on a page if it is: "KITTI, 2"
  /// @param pair  outlives the panels
  FigurePanels(std::string name, const ImageShape& image, const VehicleShape& vehicle,
               const FigurePair& pair);

  /// A scan as a range image, from above and from the side, with the vehicle.
  /// @param letter  of the figure
  [[nodiscard]] std::vector<report::Plot> model(char letter) const;
  [[nodiscard]] std::vector<report::Plot> data(char letter) const;

  /// Both scans in the frame of the model, with the vehicle at both; the windows do not depend on
  /// the pose.
  [[nodiscard]] report::Plot above(char letter, const PlacedData& placed) const;
  [[nodiscard]] report::Plot side(char letter, const PlacedData& placed) const;
  [[nodiscard]] report::Plot detail(char letter, const PlacedData& placed) const;

  /// Distances of the closest points before and after each method, point by point with one scale,
  /// and as histograms.
  [[nodiscard]] std::vector<report::Plot> distances(char letter) const;

  struct Pairs {
    std::vector<report::Plot> plots;
    std::size_t accepted = 0;
    std::size_t rejected = 0;
  };
  /// The pairs of closest points in a small part, from above and from the side.
  [[nodiscard]] Pairs pairs(char letter, const MidwaySearch& search) const;

 private:
  struct Layer {
    std::string label;
    report::Colour colour;
    const Points& points_picture;
    Pose T_picture_ladar;
  };

  [[nodiscard]] std::string title(char letter, const std::string& what) const;
  [[nodiscard]] std::vector<Layer> layers(const PlacedData& placed) const;
  [[nodiscard]] report::Plot scene(const std::string& title, const std::vector<Layer>& layers,
                                   report::Projection projection,
                                   const report::Window& window) const;
  [[nodiscard]] std::vector<report::Plot> scan(char letter, const char* label,
                                               report::Colour colour,
                                               const Points& points_ladar) const;

  std::string name_;
  ImageShape image_;
  VehicleShape vehicle_;
  const FigurePair& pair_;
  report::MatchView view_;
};

}  // namespace rcs::studies
