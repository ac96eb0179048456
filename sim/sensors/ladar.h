#pragma once
// Two LADARs: the range imager of Demo III on its tilting head, and a spinning one with 64 beams.
// Every shot has its own time, for which the true poses of vehicle and head are used.

#include <cstdint>
#include <vector>

#include "rcs/base/pose.h"
#include "sim/actors/actor.h"
#include "sim/base/random.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

/// Errors of a beam, common to both scanners.
struct BeamParams {
  double max_range_m = 60.0;
  double sigma_m = 0.03;                 ///< of a range at normal incidence
  double half_angle_rad = radians(0.1);  ///< of the beam; 0: no mixed pixels
  /// Share of the range spread over the footprint on a slanted surface that is noise.
  double incidence_share = 0.25;
  double missing_share = 0.15;      ///< of the returns, including those of empty facets
  double empty_facet_share = 0.03;  ///< of the facets; part of missing_share
};

/// Pose of the LADAR, and its uncalibrated error.
struct MountParams {
  Pose T_vehicle_mount{Quat::Identity(), Vec3(0.9, 0.0, 0.9)};  ///< nominal, head at rest
  double error_m = 0.01;            ///< of the position; direction by seed
  double error_rad = radians(0.2);  ///< of the attitude; axis by seed
};

struct ImagerParams {
  int rows = 32;
  int cols = 180;
  int facets = 16;  ///< divides rows
  double fov_v_rad = radians(20.0);
  double fov_h_rad = radians(90.0);
  double period_s = 0.1;             ///< of a scan
  double tilt_rad = radians(-10.0);  ///< of the head; with a sweep, its centre
  double sweep_rad = 0.0;            ///< amplitude of the sinusoidal tilt
  double sweep_hz = 0.25;
};

struct SpinningParams {
  int beams = 64;    ///< row 0 lowest
  int cols = 1824;   ///< in a revolution, clockwise from straight behind
  int sectors = 48;  ///< divides cols
  double lowest_rad = radians(-24.8);
  double highest_rad = radians(2.0);
  double period_s = 0.1;  ///< of a revolution
};

/// The pan/tilt encoder at the first shot of a facet.
struct HeadAngle {
  double tilt_rad = 0.0;  ///< positive up
  double tilt_rate_radps = 0.0;
};

/// A part of a range image.
struct RangeFacet {
  HeadAngle head;
  int first_row = 0;
  int rows = 0;
  std::vector<float> range_m;  ///< rows x cols; 0: no return; empty: the whole facet has no return
};

/// A part of a revolution, in the ladar frame.
struct PointSector {
  std::vector<float> x_m, y_m, z_m;
  std::vector<std::int16_t> row, col;
  std::vector<std::int32_t> dt_us;  ///< after the first shot of the sector
};

/// Casts shots and adds the errors of the beam.
class Beam {
 public:
  Beam(const BeamParams& params, std::uint64_t seed)
      : params_(params), random_(seed, Stream::kLadar) {}

  [[nodiscard]] const BeamParams& params() const { return params_; }
  /// @param actors  that rays hit from now on; outlives the beam. Null: none
  void set_actors(const Actors* actors) { actors_ = actors; }
  /// The range without noise; 0: no return.
  /// @param clear_m  free range: nothing but an actor is hit before it
  [[nodiscard]] double cast(const World& world, const Ray& ray, double time_s,
                            double* cos_incidence, double clear_m = 0.0);
  /// Adds noise to a range; 0: no return, or out of range.
  [[nodiscard]] double measure(double range_m, double cos_incidence);
  /// Drawn once a facet, or once a shot that need not be cast then.
  [[nodiscard]] bool facet_is_empty();
  [[nodiscard]] bool shot_is_missing();
  [[nodiscard]] Random& random() { return random_; }

 private:
  BeamParams params_;
  Random random_;
  const Actors* actors_ = nullptr;
};

class RangeImager {
 public:
  RangeImager(const ImagerParams& params, const BeamParams& beam, const MountParams& mount,
              std::uint64_t seed);

  [[nodiscard]] const ImagerParams& params() const { return params_; }
  void set_actors(const Actors* actors) { beam_.set_actors(actors); }
  [[nodiscard]] double facet_duration_s() const { return params_.period_s / params_.facets; }
  [[nodiscard]] HeadAngle head_at(double time_s) const;
  /// The true mount at a time, including its error.
  [[nodiscard]] Pose T_vehicle_ladar(double time_s) const;
  /// Unit vector of a pixel in the ladar frame.
  [[nodiscard]] Vec3 direction(int row, int col) const;

  /// @param start_s  first shot of the facet; column c is shot after c / cols of its duration
  void render(const World& world, const Trajectory& vehicle, double start_s, int facet,
              RangeFacet* out);

 private:
  struct Shot {
    double range_m;
    double cos_incidence;
  };
  /// Pose of the ladar in frame world.
  struct Column {
    Mat3 R_world_ladar;
    Vec3 p_world;
  };
  void place_columns(const Trajectory& vehicle, double start_s);
  void cast_columns(const World& world, double start_s, int first_row, int rows, int first_col,
                    int end_col);
  void mix_pixels(const World& world, double start_s, int first_row);
  [[nodiscard]] double shot_time(double start_s, int col) const {
    return start_s + facet_duration_s() * col / params_.cols;
  }

  ImagerParams params_;
  Beam beam_;
  Pose T_vehicle_mount_;
  std::vector<Vec3> direction_ladar_;
  std::vector<Column> columns_;  // of the current facet
  std::vector<Ray> rays_;        // of the current fan, column by column
  std::vector<Shot> shots_;
};

class SpinningLadar {
 public:
  SpinningLadar(const SpinningParams& params, const BeamParams& beam, const MountParams& mount,
                std::uint64_t seed);

  [[nodiscard]] const SpinningParams& params() const { return params_; }
  void set_actors(const Actors* actors) { beam_.set_actors(actors); }
  [[nodiscard]] const Pose& T_vehicle_ladar() const { return T_vehicle_ladar_; }

  /// @param start_s  first shot of the sector
  void render(const World& world, const Trajectory& vehicle, double start_s, int sector,
              PointSector* out);

 private:
  SpinningParams params_;
  Beam beam_;
  Pose T_vehicle_ladar_;
};

}  // namespace rcs::sim
