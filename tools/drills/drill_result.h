#pragma once
// What came of a drill: the figures of its runs, and whether they pass its marks.

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

/// Of one seed.
struct DrillRunFigures {
  std::int64_t seed = 0;
  double simulated_s = 0.0;
  AccuracyFigures accuracy;
  std::vector<OutageDrift> outages;
  SmoothStep smooth;
  std::map<std::string, NisFigure> nis;
  std::vector<FalseAcceptance> false_acceptances;
  std::vector<GpsReturn> returns;
  std::optional<IntegrityFigures> integrity;  ///< none: not published
  Baselines baselines;
  bool subfilters_published =
      false;  ///< else the baselines are runs of their own, if there are any
  std::map<std::string, int> stops;
  std::int64_t overruns = 0;
  std::int64_t missed = 0;
  std::uint64_t hash = 0;
};

/// Without the baselines of runs of their own.
[[nodiscard]] DrillRunFigures drill_figures(const Drill& drill, std::int64_t seed,
                                            const DrillRecord& record);

enum class Verdict {
  kPass,
  kFail,
  kOpen  ///< too few seeds to tell
};

struct MarkResult {
  const MarkKind* kind = nullptr;
  double limit = 0.0;
  std::optional<double> value;  ///< none: see the note
  Verdict verdict = Verdict::kFail;
  std::string note;
};

struct DrillResult {
  Drill drill;
  std::vector<DrillRunFigures> runs;  ///< by seed
  std::vector<MarkResult> marks;
  std::optional<DrillRecord> shown;  ///< of the first seed, for the pictures
  std::string error;                 ///< it could not be run; empty: it was
  std::string skipped;               ///< why it was not run; empty: it was

  /// kOpen when nothing fails and nothing could be judged.
  [[nodiscard]] Verdict verdict() const;
};

[[nodiscard]] std::vector<MarkResult> judge(const Drill& drill,
                                            const std::vector<DrillRunFigures>& runs);

/// A figure over the seeds, whether or not a mark is set on it; none where it has no meaning.
[[nodiscard]] MarkResult drill_figure(const MarkKind& kind,
                                      const std::vector<DrillRunFigures>& runs);

/// Summed over the runs.
[[nodiscard]] Baselines pooled_baselines(const std::vector<DrillRunFigures>& runs);

}  // namespace rcs::drills
