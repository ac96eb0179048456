#pragma once
// The state of the system at the moment that is shown, as JSON for the page and as text for
// Prometheus.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/evaluation/top_model.h"
#include "tools/view/source/source.h"

namespace rcs::view {

/// Counts of the viewer itself.
struct ViewerCounts {
  std::int64_t clients = 0;            ///< connected now
  std::int64_t messages_sent = 0;      ///< so far
  std::int64_t bytes_sent = 0;         ///< so far
  std::int64_t messages_dropped = 0;   ///< replaced by newer ones before a client received them
  std::int64_t clients_dropped = 0;    ///< because they did not read
  std::int64_t messages_received = 0;  ///< of the bus or of the log
  std::int64_t malformed = 0;
  std::int64_t bytes_waiting = 0;  ///< in all queues now
};

class RunStatus {
 public:
  /// A message of a channel that the status does not use is ignored.
  void add(const SourceMessage& message);
  /// Forgets everything, because the moment jumped.
  void clear() { model_ = {}; }

  /// @param now  the time of the source
  [[nodiscard]] evaluation::TopView view(Duration now) { return model_.view(stamp(now)); }

 private:
  static Stamp stamp(Duration time) { return Stamp(time); }
  evaluation::TopModel model_;
};

/// The channels that RunStatus uses.
[[nodiscard]] ChannelSet status_channels();

[[nodiscard]] nlohmann::ordered_json to_json(const evaluation::TopView& view);

/// In the text format 0.0.4 of Prometheus.
[[nodiscard]] std::string metrics_text(const evaluation::TopView& view, const ViewerCounts& counts);

}  // namespace rcs::view
