#pragma once
// The result of a drill: the metrics of its runs and the verdicts against its limits.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/drills/drill_baselines.h"
#include "tools/drills/drill_fault_detection.h"
#include "tools/drills/drill_limits.h"
#include "tools/drills/drill_metrics.h"

namespace rcs::drills {

/// Metrics of one seed.
struct DrillRunMetrics {
  std::int64_t seed = 0;
  double simulated_s = 0.0;
  AccuracyMetrics accuracy;
  std::vector<OutageDrift> outages;
  SmoothStep smooth;
  std::map<std::string, NisMetric> nis;
  std::vector<FalseAcceptance> false_acceptances;
  std::vector<GpsReturn> returns;
  std::optional<IntegrityMetrics> integrity;  ///< nullopt: not published
  Baselines baselines;
  bool subfilters_published = false;  ///< else the baselines are separate runs, if any
  std::map<std::string, int> stops;
  std::int64_t overruns = 0;
  std::int64_t missed = 0;
  std::uint64_t hash = 0;
};

/// Without the baselines of separate runs.
[[nodiscard]] DrillRunMetrics drill_metrics(const Drill& drill, std::int64_t seed,
                                            const DrillRecord& record);

enum class Verdict {
  kPass,
  kFail,
  kInconclusive  ///< too few seeds
};

struct LimitResult {
  const LimitKind* kind = nullptr;
  double limit = 0.0;
  std::optional<double> value;  ///< nullopt: see the note
  Verdict verdict = Verdict::kFail;
  std::string note;
};

struct DrillResult {
  Drill drill;
  std::vector<DrillRunMetrics> runs;  ///< by seed
  std::vector<LimitResult> limits;
  std::optional<DrillRecord> shown;  ///< of the first seed, for the pictures
  std::string error;                 ///< reason of a failed run; empty: none
  std::string skipped;               ///< reason for skipping; empty: not skipped

  /// kInconclusive if no limit fails and none could be judged.
  [[nodiscard]] Verdict verdict() const;
};

[[nodiscard]] std::vector<LimitResult> judge(const Drill& drill,
                                             const std::vector<DrillRunMetrics>& runs);

/// A metric over the seeds, whether or not it has a limit; without a value where undefined.
[[nodiscard]] LimitResult drill_metric(const LimitKind& kind,
                                       const std::vector<DrillRunMetrics>& runs);

/// Sums over the runs.
[[nodiscard]] Baselines pooled_baselines(const std::vector<DrillRunMetrics>& runs);

}  // namespace rcs::drills
