#pragma once
// Monitor of a source of measurements: its state, and how long it must agree before it is used
// again. The transitions are one table, next_state(), the same for every source.

#include "rcs/base/stamp.h"

namespace rcs::wm {

enum class SourceState : int {
  kUsed,         ///< fused, and no test contradicts it
  kSuspect,      ///< fused; a test contradicts it and has not decided yet
  kExcluded,     ///< not fused
  kReadmitting,  ///< not fused; it agrees with what is fused
  kProbation     ///< fused again since a short time: the readmission can be revoked
};

/// Of a source, at one instant.
struct SourceFacts {
  bool excluded = false;      ///< the filter does not fuse it
  bool contradicted = false;  ///< a test of it is above its limit
  bool agrees = false;        ///< with what is fused, while it is excluded
  bool readmitted = false;    ///< it is fused again because it agreed, not because another source
                              ///< was the faulty one or the filter has been restarted
  bool watched = false;       ///< readmitted less than the time of probation ago
};

/// An excluded source is used again only by a readmission or because its exclusion was a
/// consequence of another fault; from every state each other one can be reached.
[[nodiscard]] SourceState next_state(SourceState state, const SourceFacts& facts);

class SourceMonitor {
 public:
  /// @param probation  after a readmission
  explicit SourceMonitor(Duration probation) : probation_(probation) {}

  void exclude(Stamp now);
  void readmit(Stamp now) { readmitted_ = now; }
  /// With the first three of SourceFacts.
  void step(bool excluded, bool contradicted, bool agrees, Stamp now);

  [[nodiscard]] SourceState state() const { return state_; }
  [[nodiscard]] Stamp excluded() const { return excluded_; }  ///< newest time; min(): never
  /// Agreement that readmits it. Doubles with each exclusion soon after a readmission.
  [[nodiscard]] Duration wait() const { return wait_; }
  [[nodiscard]] bool on_probation(Stamp now) const { return readmitted_within(now, probation_); }
  /// An exclusion now is a relapse.
  [[nodiscard]] bool recently_readmitted(Stamp now) const {
    return readmitted_within(now, probation_ + kRelapse);
  }

 private:
  static constexpr Duration kAgrees = from_seconds(5.0);
  static constexpr Duration kLongestWait = from_seconds(300.0);
  static constexpr Duration kRelapse = from_seconds(60.0);  // after the probation

  [[nodiscard]] bool readmitted_within(Stamp now, Duration time) const {
    return readmitted_ != Stamp::min() && now - readmitted_ < time;
  }

  Duration probation_;
  SourceState state_ = SourceState::kUsed;
  Stamp excluded_ = Stamp::min();
  Stamp readmitted_ = Stamp::min();
  Duration wait_ = kAgrees;
};

struct SourceMonitors {
  explicit SourceMonitors(Duration probation)
      : gps(probation),
        ladar(probation),
        ins(probation),
        odometry(probation),
        prior_map(probation) {}
  SourceMonitor gps, ladar, ins, odometry, prior_map;
};

}  // namespace rcs::wm
