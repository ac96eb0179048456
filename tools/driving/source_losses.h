#pragma once
// Sensors that fall silent during a closed-loop drive.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs::driving {

/// No message of these channels arrives from `begin_s` to `end_s` after the start of the
/// simulation.
struct SourceLoss {
  std::string source;  ///< GPS, LADAR, INS or wheels
  std::vector<std::string> channels;
  double begin_s = 0.0;
  double end_s = 0.0;
};

/// Three losses of 2 to 60 s within the first 80 s, each of any source; they may overlap.
[[nodiscard]] std::vector<SourceLoss> draw_losses(std::uint64_t seed);

/// "GPS 12 to 40 s, LADAR 13 to 15 s".
[[nodiscard]] std::string describe(const std::vector<SourceLoss>& losses);

/// The events of another source without those that are lost.
class WithLosses final : public EventSource {
 public:
  /// @param source  outlives it
  WithLosses(EventSource* source, std::vector<SourceLoss> losses)
      : source_(source), losses_(std::move(losses)) {}
  [[nodiscard]] Stamp peek() override { return source_->peek(); }
  void take(SourceEvent* event) override;

 private:
  EventSource* source_;
  std::vector<SourceLoss> losses_;
};

}  // namespace rcs::driving
