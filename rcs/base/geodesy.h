#pragma once
// WGS84 <-> a local east-north-up tangent frame. The only user of GeographicLib.

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"

namespace rcs {

/// Height above the WGS84 ellipsoid [m], on which the local frame is based.
struct EllipsoidalHeight {
  double m = 0.0;
};

/// Height above the geoid ("mean sea level") [m]. It differs from the ellipsoidal height by the
/// undulation (-107 to +86 m): each kind has its type, so that they cannot be mixed silently.
struct OrthometricHeight {
  double m = 0.0;
};

/// Height of the geoid above the ellipsoid at a location [m].
struct Undulation {
  double m = 0.0;
};

inline EllipsoidalHeight to_ellipsoidal(OrthometricHeight h, Undulation n) { return {h.m + n.m}; }
inline OrthometricHeight to_orthometric(EllipsoidalHeight h, Undulation n) { return {h.m - n.m}; }

struct Geodetic {
  double lat_rad = 0.0;
  double lon_rad = 0.0;
  EllipsoidalHeight height;
};

/// True for a latitude in [-90, 90] deg, a longitude in [-180, 360] deg and a height in
/// [-1, 20] km; false for NaN.
[[nodiscard]] bool plausible(const Geodetic& g);

/// East-north-up frame tangent to the ellipsoid at its datum; frame `world` of this project.
class LocalFrame {
 public:
  /// @param datum  the frame's origin; must be plausible()
  explicit LocalFrame(const Geodetic& datum);

  [[nodiscard]] const Geodetic& datum() const { return datum_; }
  [[nodiscard]] Vec3 to_world(const Geodetic& g) const;  ///< [m], east, north, up
  [[nodiscard]] Geodetic to_geodetic(const Vec3& p_world) const;

  /// T_this_other: from another local frame to this one (exact, because both are Cartesian).
  [[nodiscard]] Pose from(const LocalFrame& other) const;

 private:
  Geodetic datum_;
  Vec3 origin_ecef_;
  Mat3 R_world_ecef_;
};

/// Normal gravity [m/s^2] at a latitude and height (WGS84, Somigliana with the free-air term).
[[nodiscard]] double normal_gravity(double lat_rad, EllipsoidalHeight height);

/// The earth's rotation rate in the east-north-up frame at a latitude [rad/s].
[[nodiscard]] Vec3 earth_rate_world(double lat_rad);

}  // namespace rcs
