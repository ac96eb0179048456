#include "sim/sensors/inertial.h"

#include <array>
#include <cmath>

namespace rcs::sim {
namespace {

Mat3 gain(double scale_error, double misalignment_rad, Random* random) {
  const auto sign = [random] { return random->uniform() < 0.5 ? -1.0 : 1.0; };
  const double x = sign();
  const double y = sign();
  const Vec3 scale = Vec3::Ones() + scale_error * Vec3(x, y, sign());
  const Vec3 turn = misalignment_rad * random->direction();
  return exp_so3(turn).toRotationMatrix() * scale.asDiagonal();
}

}  // namespace

Planet Planet::at(const Geodetic& place) {
  return {normal_gravity(place.lat_rad, place.height), earth_rate_world(place.lat_rad)};
}

InertialIncrement perfect_increment(const Trajectory& vehicle, const Planet& planet, double begin_s,
                                    double end_s) {
  // Gauss-Legendre with five points: exact to rounding between knots of the motion.
  constexpr std::array<double, 5> kNode = {-0.9061798459386640, -0.5384693101056831, 0.0,
                                           0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 5> kWeight = {0.2369268850561891, 0.4786286704993665,
                                             0.5688888888888889, 0.4786286704993665,
                                             0.2369268850561891};
  const double half_s = 0.5 * (end_s - begin_s);
  InertialIncrement sum;
  for (std::size_t k = 0; k < kNode.size(); ++k) {
    const Motion m = vehicle.at(begin_s + half_s * (1.0 + kNode[k]));
    const Quat q_vehicle_world = m.T_world_vehicle.q.conjugate();
    // Frame world rotates with the earth: Coriolis; the centrifugal part is included in gravity.
    const Vec3 force_world =
        m.a_world + 2.0 * planet.rate_world.cross(m.v_world) + Vec3(0.0, 0.0, planet.gravity_mps2);
    sum.delta_angle += kWeight[k] * half_s * (m.rate_vehicle + q_vehicle_world * planet.rate_world);
    sum.delta_v += kWeight[k] * half_s * (q_vehicle_world * force_world);
  }
  return sum;
}

InertialSensor::InertialSensor(const InertialParams& params, const Planet& planet,
                               std::uint64_t seed)
    : params_(params),
      planet_(planet),
      random_(seed, Stream::kInertial),
      gyro_bias_(params.grade.gyro_bias_radps * random_.normal3()),
      accel_bias_(params.grade.accel_bias_mps2 * random_.normal3()),
      gyro_gain_(gain(params.scale_error, params.misalignment_rad, &random_)),
      accel_gain_(gain(params.scale_error, params.misalignment_rad, &random_)),
      gyro_drift_(params.grade.gyro_instability_radps, params.grade.correlation_s, &random_),
      accel_drift_(params.grade.accel_instability_mps2, params.grade.correlation_s, &random_) {}

InertialIncrement InertialSensor::measure(const Trajectory& vehicle, double end_s) {
  const double dt = params_.interval_s;
  const double root_dt = std::sqrt(dt);
  const InertialIncrement truth = perfect_increment(vehicle, planet_, end_s - dt, end_s);
  InertialIncrement out;
  out.delta_angle = gyro_gain_ * truth.delta_angle +
                    dt * (gyro_bias_ + gyro_drift_.step(dt, &random_)) +
                    params_.grade.gyro_walk_radprs * root_dt * random_.normal3();
  out.delta_v = accel_gain_ * truth.delta_v + dt * (accel_bias_ + accel_drift_.step(dt, &random_)) +
                params_.grade.accel_walk_mpsrs * root_dt * random_.normal3();
  return out;
}

}  // namespace rcs::sim
