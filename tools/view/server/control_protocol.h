#pragma once
// The second WebSocket of the page, subprotocol rcs.view.v1: JSON texts that move the moment of a
// log. The page sends {"op":"play"}, {"op":"pause"}, {"op":"seek","t":97.5} and
// {"op":"speed","value":2}; the server sends "source" once and "state" after changes.

#include <string>
#include <string_view>

namespace rcs::view {

inline constexpr char kControlProtocol[] = "rcs.view.v1";

struct ControlRequest {
  enum class Kind { kProblem, kPlay, kPause, kSeek, kSpeed };
  Kind kind = Kind::kProblem;
  double value = 0.0;   ///< kSeek: [s]; kSpeed: multiple of real time
  std::string problem;  ///< kProblem: why nothing is requested
};

/// @param text  untrusted
[[nodiscard]] ControlRequest parse_control(std::string_view text);

}  // namespace rcs::view
