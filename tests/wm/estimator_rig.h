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

}  // namespace rcs::wm
