#include "tools/studies/simulated_scans.h"

#include "rcs/base/check.h"
#include "sim/vehicle/scripted_drive.h"

namespace rcs::studies {
namespace {

constexpr double kReach_m = 20.0;  // margin of the world beyond the range of the LADAR
constexpr double kMoving_s = 3.0;  // from the start to the first scan, and from the last to the end

class Imaging {
 public:
  explicit Imaging(const sim::Scenario& scenario)
      : scenario_(scenario),
        course_(scenario.course),
        world_(scenario.world, scenario.dem, course_.points(),
               scenario.beam.max_range_m + kReach_m),
        vehicle_(drive(course_, world_, scenario.vehicle, course_.duration_s())),
        imager_(scenario.imager, scenario.beam, without_error(scenario.mount), scenario.seed),
        calibration_(ladar_in_mount(scenario)) {}

  [[nodiscard]] double period_s() const { return scenario_.imager.period_s; }
  [[nodiscard]] double duration_s() const { return course_.duration_s(); }

  [[nodiscard]] Pose T_world_scan(int number) const { return T_world_mount(middle_s(number)); }

  Points scan(int number) {
    sp::Scan scan;
    sim::RangeFacet facet;
    for (int f = 0; f < scenario_.imager.facets; ++f) {
      const double start_s = number * period_s() + f * imager_.facet_duration_s();
      imager_.render(world_, vehicle_, start_s, f, &facet);
      sp::RangeFacet view;
      view.range_m = facet.range_m.data();
      view.first_row = facet.first_row;
      view.facet_rows = facet.range_m.empty() ? 0 : facet.rows;
      view.start = from_seconds(start_s - middle_s(number));
      view.duration = from_seconds(imager_.facet_duration_s());
      view.tilt_rad = facet.head.tilt_rad;
      view.tilt_rate_radps = facet.head.tilt_rate_radps;
      calibration_.append(view, &scan);
    }
    const Pose T_scan_world = T_world_scan(number).inverse();
    Points deskewed;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const double shot_s = middle_s(number) + 1e-6 * scan.dt_us[i];
      deskewed.push_back(
          (T_scan_world * T_world_mount(shot_s) * scan.points[i].cast<double>()).cast<float>());
    }
    return deskewed;
  }

 private:
  [[nodiscard]] double middle_s(int number) const { return (number + 0.5) * period_s(); }
  [[nodiscard]] Pose T_world_mount(double time_s) const {
    return vehicle_.pose_at(time_s) * scenario_.mount.T_vehicle_mount;
  }

  const sim::Scenario& scenario_;
  sim::Course course_;
  sim::World world_;
  sim::Trajectory vehicle_;
  sim::RangeImager imager_;
  sp::Calibration calibration_;
};

}  // namespace

sp::LadarParams ladar_in_mount(const sim::Scenario& scenario) {
  sp::LadarParams p;
  p.rows = scenario.imager.rows;
  p.cols = scenario.imager.cols;
  p.fov_v_rad = scenario.imager.fov_v_rad;
  p.fov_h_rad = scenario.imager.fov_h_rad;
  p.max_range_m = scenario.beam.max_range_m;
  return p;
}

sim::MountParams without_error(sim::MountParams mount) {
  mount.error_m = mount.error_rad = 0.0;
  return mount;
}

ScanSet simulate_scans(const sim::Scenario& scenario, int models) {
  Imaging imaging(scenario);
  const double first_s = scenario.course.rest_s + kMoving_s;
  const double last_s = imaging.duration_s() - kMoving_s - kApart * imaging.period_s();
  RCS_CHECK(models > 0 && last_s > first_s);
  ScanSet set;
  for (int m = 0; m < models; ++m) {
    const double start_s = first_s + (last_s - first_s) * m / models;
    const int model = static_cast<int>(start_s / imaging.period_s());
    for (const int data : {model, model + 1, model + kApart}) {
      if (set.scans.count(data) == 0) set.scans.emplace(data, imaging.scan(data));
      if (data == model) continue;
      set.pairs.push_back(
          {model, data, imaging.T_world_scan(model).inverse() * imaging.T_world_scan(data)});
    }
  }
  return set;
}

}  // namespace rcs::studies
