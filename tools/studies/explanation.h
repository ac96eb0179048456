#pragma once
// Explanation of the state of a run at one moment: inputs, decisions of WM, results of SP and BG.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/log/log_file.h"
#include "tools/studies/message_history.h"

namespace rcs::studies {

/// The same content in two forms.
struct Explanation {
  std::string text;
  nlohmann::ordered_json json;
};

/// @param log  read from its begin
/// @param after  time after the first message of the log
/// @return an error if the log ends before
/// @param progress  called with the share of the log that is read; returns false to stop
[[nodiscard]] Result<Explanation> explain(LogReader* log, Duration after,
                                          const std::function<bool(double)>& progress);

/// The same from messages that were collected elsewhere: events of MessageHistory::kEvents, all
/// other channels of MessageHistory::kRecent and at least the newest message of each.
/// @param log  path, for the text
/// @param begin  of the log
[[nodiscard]] Explanation explanation_of(const MessageHistory& history, const std::string& log,
                                         Stamp begin, Stamp moment);

/// Every choice of a route by the mission: the candidates with their values, verdicts and reasons.
/// @param log  read from its begin to its end
/// @param progress  as above
[[nodiscard]] Result<Explanation> explain_routes(LogReader* log,
                                                 const std::function<bool(double)>& progress);

/// The same from messages that were collected elsewhere.
[[nodiscard]] Explanation explanation_of_routes(const std::vector<Received<routes_t>>& choices,
                                                const std::string& log, Stamp begin);

}  // namespace rcs::studies
