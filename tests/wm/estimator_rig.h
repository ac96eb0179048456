#pragma once
// A synthetic drive with its sensors, and an estimator of it.

#include <vector>

#include "modules/wm/estimator.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {

struct Experiment {
  bool ins = true, gps = true, ladar = true, odometry = false;
  double outage_from_s = 1e9, outage_to_s = 1e9;
  DriveScript drive;
  SensorScript sensors;
  WmParams params;
};

/// A drive, its sensors and its estimator.
struct Rig {
  explicit Rig(const Experiment& experiment = {})
      : truth(make_drive(experiment.drive)),
        sensors(truth, experiment.params, experiment.sensors),
        estimator(experiment.params, test_datum()) {}
  Rig(const Rig&) = delete;  // the sensors refer to its ground truth
  Rig& operator=(const Rig&) = delete;
  ~Rig() = default;

  const std::vector<Truth> truth;
  Sensors sensors;
  Estimator estimator;
};

/// How well the estimator did on a drive.
struct Score {
  double nees_pose = 0.0;       ///< mean per degree of freedom, position and attitude
  double error_m = 0.0;         ///< of position, at the end
  double worst_error_m = 0.0;   ///< once georeferenced
  double height_error_m = 0.0;  ///< at the end
  double heading_error_rad = 0.0;
  double sigma_m = 0.0;  ///< horizontal, at the end
  int refused = 0, accepted = 0;
  int resets = 0;
  bool georeferenced = false;
  double georeferenced_s = -1.0;  ///< after the start
  Mode mode = Mode::kAlign;
  int samples = 0;
};

/// The whole drive of an experiment.
[[nodiscard]] Score run(const Experiment& experiment);

}  // namespace rcs::wm
