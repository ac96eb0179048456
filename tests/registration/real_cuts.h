#pragma once
// Production registration compared with the motion between real sweeps, cut to the paper's size.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/studies/cloud_match.h"
#include "tools/studies/kitti_drive.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::test {

/// Folder of the drive below RCS_DATA_DIR; empty without it.
[[nodiscard]] std::vector<studies::KittiDrive> open_drive();

/// Pairs of a scan and the next one.
[[nodiscard]] std::vector<studies::ScanPair> consecutive(
    const std::vector<studies::ScanPair>& pairs);

/// T_model_data of pairs of scans.
using Motions = std::map<std::pair<int, int>, Pose>;

[[nodiscard]] Motions motions_of(const std::vector<studies::ScanPair>& pairs);

using Registrations = std::map<std::pair<int, int>, registration::Registration>;
[[nodiscard]] Motions motions_of(const Registrations& registrations);

/// The motions computed from the whole sweeps, with those of the pairs as the guess.
/// @param deskew  false: a sweep is treated as rigid, as in the references; true: its
///                points are moved to its middle with the motion to the next sweep, which `pairs`
///                must contain for each model (that of pair k, k + 1 serves k + 1, too)
[[nodiscard]] Registrations register_whole_sweeps(const studies::KittiDrive& drive,
                                                  const std::vector<studies::ScanPair>& pairs,
                                                  bool deskew);

struct TrialRun {
  studies::Trial trial;
  studies::CloudMatch match;
};

enum class Search { kFromGuess, kGlobal };

[[nodiscard]] std::vector<TrialRun> run_production(const studies::ScanSet& set,
                                                   const std::vector<studies::Trial>& trials,
                                                   Search search);

struct Metrics {
  int trials = 0;
  int successes = 0;
  double median_m = 0.0;
  double median_deg = 0.0;
  std::map<int, int> failures;  ///< number of failures by model scan
  int refused = 0;              ///< results that the method itself reports as not good
  int falsely_accepted = 0;     ///< wrong results that were not rejected

  [[nodiscard]] double share() const { return static_cast<double>(successes) / trials; }
};

[[nodiscard]] Metrics metrics_of(const std::vector<TrialRun>& runs, const Motions& truth);

/// Median CPU time by stage: "prepare 0.20 + search 0.50 + refine 1.50 = 2.20 ms".
[[nodiscard]] std::string cpu_text(const std::vector<TrialRun>& runs);

}  // namespace rcs::test
