#include "rcs/base/geodesy.h"

#include <GeographicLib/Constants.hpp>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <cmath>
#include <vector>

#include "rcs/base/check.h"

namespace rcs {
namespace {

Vec3 to_ecef(const Geodetic& g, Mat3* R_ecef_enu) {
  const GeographicLib::Geocentric& earth = GeographicLib::Geocentric::WGS84();
  Vec3 p;
  if (R_ecef_enu == nullptr) {  // the variant without allocation
    earth.Forward(degrees(g.lat_rad), degrees(g.lon_rad), g.height.m, p.x(), p.y(), p.z());
    return p;
  }
  std::vector<double> m(9);
  earth.Forward(degrees(g.lat_rad), degrees(g.lon_rad), g.height.m, p.x(), p.y(), p.z(), m);
  // GeographicLib returns the rotation enu -> ecef row by row.
  *R_ecef_enu = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(m.data());
  return p;
}

}  // namespace

bool plausible(const Geodetic& g) {
  return std::abs(g.lat_rad) <= kPi / 2 && g.lon_rad >= -kPi && g.lon_rad <= 2 * kPi &&
         g.height.m >= -1000.0 && g.height.m <= 20000.0;
}

LocalFrame::LocalFrame(const Geodetic& datum) : datum_(datum) {
  RCS_CHECK(plausible(datum));
  Mat3 R_ecef_world;
  origin_ecef_ = to_ecef(datum, &R_ecef_world);
  R_world_ecef_ = R_ecef_world.transpose();
}

Vec3 LocalFrame::to_world(const Geodetic& g) const {
  return R_world_ecef_ * (to_ecef(g, nullptr) - origin_ecef_);
}

Geodetic LocalFrame::to_geodetic(const Vec3& p_world) const {
  const Vec3 p = origin_ecef_ + R_world_ecef_.transpose() * p_world;
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  double height_m = 0.0;
  GeographicLib::Geocentric::WGS84().Reverse(p.x(), p.y(), p.z(), lat_deg, lon_deg, height_m);
  return {radians(lat_deg), radians(lon_deg), {height_m}};
}

Pose LocalFrame::from(const LocalFrame& other) const {
  const Mat3 R_this_other = R_world_ecef_ * other.R_world_ecef_.transpose();
  return {Quat(R_this_other).normalized(), R_world_ecef_ * (other.origin_ecef_ - origin_ecef_)};
}

double normal_gravity(double lat_rad, EllipsoidalHeight height) {
  double gy = 0.0;
  double gz = 0.0;
  GeographicLib::NormalGravity::WGS84().Gravity(degrees(lat_rad), height.m, gy, gz);
  return std::hypot(gy, gz);
}

Vec3 earth_rate_world(double lat_rad) {
  const double rate = GeographicLib::Constants::WGS84_omega();
  return {0.0, rate * std::cos(lat_rad), rate * std::sin(lat_rad)};
}

}  // namespace rcs
