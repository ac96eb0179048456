#pragma once
// Plots as SVG text: axes with ticks and units, legend, light or dark by the preference of the
// reader.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::report {

/// Colours of the palette, distinguishable for colour-blind readers (Okabe and Ito 2008).
enum class Colour { kBlue, kOrange, kGreen, kPurple, kYellow, kGrey };

enum class SeriesStyle {
  kLine,
  kThickLine,
  kDashed,
  kBand,  ///< filled between y_low and y
  kBars,  ///< from 0 (or the bottom of the axis) to y, as wide as the distance of the x
  kHair,  ///< a thin line with all of its points
  kDots   ///< separate points
};

struct Series {
  std::string label;  ///< in the legend; empty: no entry
  Colour colour = Colour::kBlue;
  SeriesStyle style = SeriesStyle::kLine;
  std::vector<double> x;
  std::vector<double> y;      ///< a non-finite value interrupts the line
  std::vector<double> y_low;  ///< of a band
};

struct Mark {
  double x = 0.0;
  double y = 0.0;
  std::string label;
};

/// A shaded interval of the x axis.
struct Shade {
  double from = 0.0;
  double to = 0.0;
  std::string label;
};

/// Square cells of a picture from above, coloured by value.
struct CellMap {
  struct Cell {
    int i = 0;  ///< covers [i, i+1) * cell along x
    int j = 0;
    double value = 0.0;
  };
  double cell = 1.0;
  std::vector<Cell> cells;  ///< sorted by j, then i
  std::string value_label;  ///< with unit
  bool log = false;         ///< logarithmic scale of colours; values are above 0
};

/// The visible part of the plane.
struct Window {
  double x_low = 0.0;
  double x_high = 1.0;
  double y_low = 0.0;
  double y_high = 1.0;
};

struct Plot {
  std::string title;
  std::string x_label;  ///< with unit
  std::string y_label;
  int width_px = 880;
  int height_px = 300;
  bool equal_scales = false;  ///< for views from above: equal scales along x and y
  bool log_x = false;         ///< for lines and dots only; values at or below 0 are omitted
  bool log_y = false;         ///< values at or below 0 are omitted
  bool y_from_zero = false;
  std::vector<std::string> y_names;  ///< lanes: names of y = 0, 1, 2 ... instead of numbers
  std::optional<Window> window;      ///< nullopt: all data
  std::vector<Shade> shades;
  std::vector<Series> series;
  std::vector<Mark> marks;
  std::optional<CellMap> map;
};

/// An empty view from above: equal scales.
/// @param world  the axes are those of frame world, east and north; otherwise x and y
[[nodiscard]] Plot view_from_above(std::string title, bool world, int height_px);

/// About `count` round values (1, 2, 2.5 or 5 times a power of ten) inside [low, high].
[[nodiscard]] std::vector<double> round_ticks(double low, double high, int count);

/// At most `count` values inside [low, high] for a logarithmic scale: 1, 2 and 5 times the powers
/// of ten, or powers of ten alone. Less than about a factor of two has the values of round_ticks().
/// @param low  above 0
/// @param count  at least 1
[[nodiscard]] std::vector<double> log_ticks(double low, double high, int count);

/// The text of a tick: at most six significant digits.
[[nodiscard]] std::string axis_number(double v);

/// @param standalone  with its own style sheet and XML name space, as a file
[[nodiscard]] std::string render(const Plot& plot, bool standalone);

/// Plots of one width, one below the other, in one file.
/// @param plots  titles or y labels differ
[[nodiscard]] std::string render_stacked(const std::vector<Plot>& plots);

/// The style sheet for plots that are not standalone.
[[nodiscard]] std::string_view plot_style();

/// `text` with <, >, & and quotes escaped.
[[nodiscard]] std::string escape_xml(std::string_view text);

}  // namespace rcs::report
