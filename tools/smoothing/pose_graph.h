#pragma once
// A whole drive as one least-squares problem: poses and velocities at its nodes, time-correlated
// errors of the sensors, and the residuals of all measurements. Pure.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "rcs/base/pose.h"
#include "tools/smoothing/preintegration.h"

namespace rcs::smoothing {

/// Parameters that are constant during the drive.
struct SharedErrors {
  /// LADAR misalignment: p_vehicle = mount * (a point by the configured mount).
  Pose mount;
  double ladar_delay_s = 0.0;  ///< delay of the measurement of a scan against its stamp
  Vec3 gyro_scale = Vec3::Zero();
  Mat3 accel_gain = Mat3::Zero();
  double wheel_scale = 0.0;  ///< measured wheel speed = speed *
  double climb_slip = 0.0;   ///< (1 + wheel_scale + climb_slip * sin(climb))
};

struct GraphState {
  std::vector<Pose> T_world_vehicle;  ///< by node
  std::vector<Vec3> v_world;          ///< [m/s]
  std::vector<Vec3> gyro_bias;        ///< by section of nodes [rad/s]
  std::vector<Vec3> accel_bias;       ///< [m/s^2]
  std::vector<Vec3> gps_bias;         ///< GPS bias, by its sections [m]
  SharedErrors shared;
};

enum class EdgeKind : std::size_t {
  kInertial = 0,
  kMotion,
  kGpsPosition,
  kGpsVelocity,
  kWheels,
  kConsecutive,  ///< a scan matched to a map of the same pass
  kRevisit,      ///< a scan matched to a map of another pass
  kPrior,        ///< priors, and random walks of time-correlated errors
};
constexpr std::size_t kEdgeKinds = 8;
[[nodiscard]] std::string_view name_of(EdgeKind kind);

struct InertialEdge {
  std::size_t from = 0, to = 0;
  std::size_t stretch = 0;  ///< section of the biases
  Preintegrated motion;
};

/// The motion between two nodes without INS; also the change of velocity, if known.
struct MotionEdge {
  std::size_t from = 0, to = 0;
  Pose T_from_to;
  Vec6 sigma = Vec6::Ones();  ///< (rho, phi)
};

/// A fix after a node.
struct GpsEdge {
  std::size_t node = 0;
  std::size_t stretch = 0;      ///< section of the GPS bias
  Pose T_node_vehicle;          ///< motion since the node
  Vec3 dv_node = Vec3::Zero();  ///< change of velocity since the node, in its vehicle axes
  Vec3 p_world_antenna = Vec3::Zero();
  Vec3 sigma_m = Vec3::Ones();  ///< of the white noise
  bool has_velocity = false;
  Vec3 v_world = Vec3::Zero();
  Vec3 sigma_mps = Vec3::Ones();
  Vec3 rate_radps = Vec3::Zero();  ///< at the fix, vehicle axes
};

/// Mean wheel speed near a node: (ahead . v + ahead_dv) in the vehicle axes of the node.
struct WheelEdge {
  std::size_t node = 0;
  Vec3 ahead = Vec3::UnitX();
  double ahead_dv_mps = 0.0;
  double speed_mps = 0.0;
  double sigma_mps = 0.1;
};

/// A scan at a node registered to the map around another node.
struct MatchEdge {
  std::size_t map = 0, scan = 0;
  Pose T_map_scan;                  ///< both with the LADAR misalignment
  Mat6 information = Mat6::Zero();  ///< right perturbation; zero along unobserved directions
  bool revisit = false;
  double rms_m = 0.0;
  double overlap = 0.0;
};

/// Priors, one sigma.
struct GraphPriors {
  std::optional<Pose> first_pose;  ///< without absolute measurements, with these sigmas
  Vec6 first_sigma = Vec6::Constant(1e-3);
  Vec3 gps_sigma_m = Vec3::Ones();  ///< of the GPS bias
  double gps_tau_s = 60.0;
  double gyro_bias_radps = 1e-4, accel_bias_mps2 = 1e-2;
  double gyro_wander_radps = 1e-6, accel_wander_mps2 = 1e-4;  ///< from section to section
  double gyro_scale = 1e-3, accel_gain = 2e-3;
  double wheel_scale = 0.02, climb_slip = 0.1;
  double mount_m = 1e-3, mount_rad = 7e-3;  ///< of SharedErrors::mount
  double ladar_delay_s = 0.0;               ///< SharedErrors::ladar_delay_s, measured beforehand
  double ladar_delay_sigma_s = 1e-5;
};

struct PoseGraph {
  Vec3 gravity_world = Vec3(0.0, 0.0, -9.80665);
  Vec3 earth_rate_world = Vec3::Zero();
  Vec3 p_vehicle_antenna = Vec3::Zero();
  std::vector<Vec6> twist;  ///< (v, rate) of the vehicle by node, vehicle axes, for the delay
  double gps_stretch_s = 2.0;
  GraphPriors priors;
  std::vector<InertialEdge> inertial;
  std::vector<MotionEdge> motion;
  std::vector<GpsEdge> gps;
  std::vector<WheelEdge> wheels;
  std::vector<MatchEdge> matches;
  std::array<double, kEdgeKinds> variance_factor{1, 1, 1, 1, 1, 1, 1, 1};  ///< by kind
};

/// Index of each unknown in the vector of all.
class Columns {
 public:
  explicit Columns(const GraphState& s)
      : nodes_(static_cast<int>(s.T_world_vehicle.size())),
        biases_(static_cast<int>(s.gyro_bias.size())),
        fixes_(static_cast<int>(s.gps_bias.size())) {}

  [[nodiscard]] int pose(std::size_t node) const { return 9 * static_cast<int>(node); }
  [[nodiscard]] int velocity(std::size_t node) const { return pose(node) + 6; }
  [[nodiscard]] int gyro_bias(std::size_t k) const { return 9 * nodes_ + 6 * static_cast<int>(k); }
  [[nodiscard]] int accel_bias(std::size_t k) const { return gyro_bias(k) + 3; }
  [[nodiscard]] int gps(std::size_t k) const {
    return 9 * nodes_ + 6 * biases_ + 3 * static_cast<int>(k);
  }
  [[nodiscard]] int mount() const { return 9 * nodes_ + 6 * biases_ + 3 * fixes_; }
  [[nodiscard]] int delay() const { return mount() + 6; }
  [[nodiscard]] int gyro_scale() const { return mount() + 7; }
  [[nodiscard]] int accel_gain() const { return mount() + 10; }
  [[nodiscard]] int wheel_scale() const { return mount() + 19; }
  [[nodiscard]] int climb_slip() const { return mount() + 20; }
  [[nodiscard]] int size() const { return mount() + 21; }

 private:
  int nodes_, biases_, fixes_;
};

/// A residual in units of its sigma, and its derivatives by blocks of unknowns.
struct LinearEdge {
  struct Block {
    int column = 0;
    Eigen::MatrixXd J;
  };
  EdgeKind kind = EdgeKind::kPrior;
  Eigen::VectorXd r;
  std::vector<Block> blocks;
};

[[nodiscard]] LinearEdge linearize(const PoseGraph& g, const GraphState& s, const InertialEdge& e);
[[nodiscard]] LinearEdge linearize(const PoseGraph& g, const GraphState& s, const MotionEdge& e);
[[nodiscard]] LinearEdge linearize_position(const PoseGraph& g, const GraphState& s,
                                            const GpsEdge& e);
[[nodiscard]] LinearEdge linearize_velocity(const PoseGraph& g, const GraphState& s,
                                            const GpsEdge& e);
[[nodiscard]] LinearEdge linearize(const PoseGraph& g, const GraphState& s, const WheelEdge& e);
[[nodiscard]] LinearEdge linearize(const PoseGraph& g, const GraphState& s, const MatchEdge& e);
/// The residuals of the priors and of the random walks of the time-correlated errors.
[[nodiscard]] std::vector<LinearEdge> linearize_priors(const PoseGraph& g, const GraphState& s);

/// The state perturbed by dx; poses on the right.
[[nodiscard]] GraphState moved(const GraphState& s, const Eigen::VectorXd& dx);

/// Pose of a node with the LADAR misalignment and at the time of the measurement of the scan.
[[nodiscard]] Pose seen_pose(const PoseGraph& g, const GraphState& s, std::size_t node);

}  // namespace rcs::smoothing
