// Moves a cloud by a known motion and registers it back.

#include <cmath>
#include <cstdio>
#include <random>

#include "modules/registration/cloud_registration.h"

int main() {
  // Two walls and a floor.
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> side(-10.0, 10.0);
  rcs::Points model;
  for (int i = 0; i < 10000; ++i) {
    model.push_back(rcs::Vec3(side(rng), side(rng), 0.0).cast<float>());
    model.push_back(rcs::Vec3(9.6, side(rng), 2.0 + 0.2 * side(rng)).cast<float>());
    model.push_back(rcs::Vec3(side(rng), 9.6, 2.0 + 0.2 * side(rng)).cast<float>());
  }
  rcs::Pose T_model_data;
  T_model_data.p = rcs::Vec3(0.3, -0.2, 0.05);
  T_model_data.q = Eigen::AngleAxisd(0.03, rcs::Vec3::UnitZ());
  rcs::Points data;
  for (std::size_t i = 0; i < model.size(); ++i) {
    data.push_back((T_model_data.inverse() * model[i].cast<double>()).cast<float>());
  }

  const rcs::registration::CloudRegistration r = rcs::registration::register_clouds(
      model, data, rcs::Pose{}, rcs::registration::CloudParams{});
  const double error_m = (r.best.T_target_vehicle.p - T_model_data.p).norm();
  std::printf("%s, error %.4f m\n", std::string(rcs::registration::name_of(r.best.stop)).c_str(),
              error_m);
  return rcs::registration::usable(r.best.stop) && error_m < 0.02 ? 0 : 1;
}
