#pragma once
// Explanation of a run at one moment as text for a terminal.

#include <string>

#include "rcs/base/stamp.h"
#include "tools/studies/message_history.h"

namespace rcs::studies {

/// @param begin  of the log, for the times of events
[[nodiscard]] std::string explanation_text(const MessageHistory& history, Stamp begin,
                                           Stamp moment);

/// Why a candidate was chosen, or was not.
[[nodiscard]] std::string route_reason(const route_t& route, const routes_t& choice);

/// The candidates of a choice as a table.
[[nodiscard]] std::string route_choice_text(const routes_t& choice);

}  // namespace rcs::studies
