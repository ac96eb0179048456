#pragma once
// The state shown by `rcs top` as text, as a screen and as JSON. Pure.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/evaluation/top_model.h"

namespace rcs::cli {

struct TopLine {
  enum class Style { kPlain, kHead, kWarning, kAlarm };
  std::string text;  ///< printable ASCII, no line end
  Style style = Style::kPlain;
};

[[nodiscard]] std::vector<TopLine> top_lines(const evaluation::TopView& view);

/// One under the other, for a file or a pipe.
[[nodiscard]] std::string plain_text(const std::vector<TopLine>& lines);

struct ScreenSize {
  int columns = 80;
  int rows = 24;
};
/// ANSI codes that draw the lines over the last screen without flicker; cut at the right and at
/// the bottom, where the last row shows the number of missing lines.
[[nodiscard]] std::string screen_text(const std::vector<TopLine>& lines, const ScreenSize& size);

/// null for missing values.
[[nodiscard]] nlohmann::ordered_json to_json(const evaluation::TopView& view);

}  // namespace rcs::cli
