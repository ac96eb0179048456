#include "tools/importers/comma2k19.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "lcmtypes/convert.h"
#include "rcs/base/check.h"

namespace rcs::importers {
namespace {

using testing::HasSubstr;

const Geodetic kStart = {radians(37.72), radians(-122.47), {30.0}};
constexpr double kHeading_rad = radians(60.0);  // counter-clockwise from east
constexpr double kMountPitch_rad = radians(4.0);
constexpr double kMountYaw_rad = radians(-2.0);
constexpr double kLatency_s = 0.1;
constexpr double kBoot_s = 40'000.0;

double speed_mps(double t_s) { return 12.0 + 4.0 * std::sin(0.5 * t_s); }
double driven_m(double t_s) { return 12.0 * t_s + 8.0 * (1.0 - std::cos(0.5 * t_s)); }

Quat turn(double rad, const Vec3& axis) { return exp_so3(rad * axis); }
Quat q_world_vehicle() { return turn(kHeading_rad, Vec3::UnitZ()); }
Quat q_vehicle_device() {
  return turn(kMountYaw_rad, Vec3::UnitZ()) * turn(kMountPitch_rad, Vec3::UnitY());
}
Vec3 place(double t_s) { return q_world_vehicle() * Vec3(driven_m(t_s), 0.0, 0.0); }

/// A synthetic folder of a minute: a straight, level road, 25 s; fixes are delayed by kLatency_s
/// and by the transport to the device, 10 to 40 ms, and lie 0.5 m to the left.
class CommaFolder : public testing::Test {
 protected:
  CommaFolder() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_comma_XXXXXX").string();
    RCS_CHECK(mkdtemp(folder_.data()) != nullptr);
    write_truth();
    write_fixes();
    // Specific force of gravity in the axes of the device: forward, right, down.
    const Vec3 up_device = q_vehicle_device().conjugate() * Vec3(0.0, 0.0, 9.8);
    std::ofstream acc(folder_ + "/imu_acc.csv");
    std::ofstream gyro(folder_ + "/imu_gyro.csv");
    std::ofstream wheels(folder_ + "/can_wheel_speed.csv");
    acc << "t,ax,ay,az\n";
    gyro << "t,wx,wy,wz\n";
    wheels << "t,fl,fr,rl,rr\n";
    for (int k = 0; k < 250; ++k) {
      const double t_s = 0.1 * k;
      acc << fmt::format("{:.6f},{:.9f},{:.9f},{:.9f}\n", kBoot_s + t_s, up_device.x(),
                         -up_device.y(), -up_device.z());
      gyro << fmt::format("{:.6f},0,0,0.1\n", kBoot_s + t_s);  // about down: to the right
      wheels << fmt::format("{:.6f},0,0,{},{}\n", kBoot_s + t_s, speed_mps(t_s) - 0.2,
                            speed_mps(t_s) + 0.2);
    }
  }
  ~CommaFolder() override { std::filesystem::remove_all(folder_); }

  void write_truth() const {
    const LocalFrame world(kStart);
    const LocalFrame equator(Geodetic{});
    // East, north and up at the equator and Greenwich are y, z and x of the earth-centred axes.
    Mat3 R_ecef_equator;
    R_ecef_equator << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    const Pose T_equator_world = equator.from(world);
    const Quat q_ecef_world = Quat(R_ecef_equator) * T_equator_world.q;
    const Quat q_flu_frd(0.0, 1.0, 0.0, 0.0);
    const Quat q = q_ecef_world * q_world_vehicle() * q_vehicle_device() * q_flu_frd;
    std::ofstream truth(folder_ + "/truth_pose.csv");
    truth << "t,ecef_x,ecef_y,ecef_z,vx_ecef,vy_ecef,vz_ecef,qw,qx,qy,qz\n";
    for (int k = 0; k <= 500; ++k) {
      const double t_s = 0.05 * k;
      const Vec3 p = R_ecef_equator * (T_equator_world * place(t_s)) + Vec3(6378137.0, 0.0, 0.0);
      const Vec3 v = q_ecef_world * (q_world_vehicle() * Vec3(speed_mps(t_s), 0.0, 0.0));
      truth << fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{},{},{},{},{},{},{}\n", kBoot_s + t_s,
                           p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), q.w(), q.x(), q.y(), q.z());
    }
  }

  void write_fixes() const {
    const LocalFrame world(kStart);
    std::ofstream fixes(folder_ + "/gnss_ublox.csv");
    fixes << "t,lat_deg,lon_deg,speed_mps,utc_ms,alt_m,bearing_deg\n";
    for (int k = 2; k < 250; ++k) {
      const double t_s = 0.1 * k;
      const double way_s = 0.01 * (1 + k % 4);
      const Vec3 p = place(t_s) + q_world_vehicle() * Vec3(0.0, 0.5, 0.0);
      const Geodetic g = world.to_geodetic(p);
      fixes << fmt::format("{:.6f},{:.10f},{:.10f},{},{:.3f},{:.4f},{}\n",
                           kBoot_s + t_s + kLatency_s + way_s, degrees(g.lat_rad),
                           degrees(g.lon_rad), speed_mps(t_s), 1.5332e12 + 1e3 * t_s, g.height.m,
                           90.0 - degrees(kHeading_rad));
    }
  }

  [[nodiscard]] recording::SensorLog import(const CommaSetup& setup) const {
    recording::SensorLog log;
    const Result<CommaTables> tables = load_comma2k19(folder_);
    EXPECT_TRUE(tables) << (tables ? "" : tables.error().message);
    if (!tables) return log;
    const Result<CommaCounts> counts = import_comma2k19(*tables, setup, &log);
    EXPECT_TRUE(counts) << (counts ? "" : counts.error().message);
    return log;
  }

  template <class Message>
  static std::vector<Message> all(const recording::SensorLog& log) {
    std::vector<Message> messages;
    for (const recording::SensorLog::Event& e : log.events()) {
      if (const auto* m = std::get_if<Message>(&e.message)) messages.push_back(*m);
    }
    return messages;
  }

  std::string folder_;
};

CommaSetup true_setup() {
  CommaSetup setup;
  setup.mount_rpy_rad = {0.0, kMountPitch_rad, kMountYaw_rad};
  setup.gps_latency_s = kLatency_s + 0.01;  // with the shortest transport delay
  return setup;
}

TEST_F(CommaFolder, TheGroundTruthIsTheVehiclePoseInTheWorldOfItsFirstPosition) {
  const std::vector<truth_t> truth = all<truth_t>(import(true_setup()));
  ASSERT_EQ(truth.size(), 501U);
  EXPECT_NEAR(truth[0].datum_lat_deg, degrees(kStart.lat_rad), 1e-9);
  EXPECT_NEAR(truth[0].datum_lon_deg, degrees(kStart.lon_rad), 1e-9);
  EXPECT_NEAR(truth[0].datum_height_m, kStart.height.m, 1e-5);
  for (const truth_t& m : truth) {
    const double t_s = 1e-6 * static_cast<double>(m.utime) - kBoot_s;
    Pose T;
    ASSERT_TRUE(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T));
    EXPECT_LT((T.p - place(t_s)).norm(), 1e-5);  // micrometres in the file
    EXPECT_LT(log_so3(T.q.conjugate() * q_world_vehicle()).norm(), 1e-7);
    EXPECT_LT((from_message(m.v_world_mps) - T.q * Vec3(speed_mps(t_s), 0, 0)).norm(), 1e-7);
    EXPECT_LT(from_message(m.rate_vehicle_radps).norm(), 1e-6);
  }
}

TEST_F(CommaFolder, AtRestTheIncrementsAreOneGUpAndRightTurnsAreNegative) {
  const std::vector<ins_t> ins = all<ins_t>(import(true_setup()));
  ASSERT_EQ(ins.size(), 249U);
  for (const ins_t& m : ins) {
    EXPECT_EQ(m.interval_us, 100'000);
    EXPECT_LT((from_message(m.delta_v_mps) - Vec3(0.0, 0.0, 0.98)).norm(), 1e-8);
    EXPECT_NEAR((q_vehicle_device().conjugate() * from_message(m.delta_angle_rad)).z(), -0.01,
                1e-12);
  }
}

TEST_F(CommaFolder, FixesHaveTheirMeasurementTimeDespiteVaryingTransport) {
  const recording::SensorLog log = import(true_setup());
  const LocalFrame world(kStart);
  int n = 0;
  for (const gps_fix_t& m : all<gps_fix_t>(log)) {
    if (++n < 4) continue;  // until one arrived with the shortest delay
    const double t_s = 1e-6 * static_cast<double>(m.utime) - kBoot_s;
    const Vec3 p = world.to_world({radians(m.lat_deg), radians(m.lon_deg), {m.height_m}});
    EXPECT_LT((p - place(t_s) - q_world_vehicle() * Vec3(0.0, 0.5, 0.0)).norm(), 1e-3) << t_s;
    EXPECT_LT((from_message(m.v_enu_mps) - q_world_vehicle() * Vec3(speed_mps(t_s), 0, 0)).norm(),
              1e-4);
    EXPECT_TRUE(m.height_kind == gps_fix_t::HEIGHT_ELLIPSOIDAL);
    EXPECT_EQ(from_message(m.sigma_enu_m), 1.7 * Vec3(1.0, 1.0, 1.5));
  }
  EXPECT_EQ(n, 248);
  for (const odometry_t& m : all<odometry_t>(log)) {
    EXPECT_NEAR(m.speed_mps, speed_mps(1e-6 * static_cast<double>(m.utime) - kBoot_s), 1e-9);
    EXPECT_TRUE(std::isnan(m.yaw_rate_radps));
  }
}

TEST_F(CommaFolder, TheCheckEstimatesTheUnknownSetup) {
  CommaSetup nothing;
  nothing.mount_rpy_rad.setZero();
  nothing.gps_latency_s = 0.0;
  const Duration span = std::chrono::seconds(20);
  const Result<SetupCheck> found = check_setup(import(nothing), Duration::zero(), span);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->mount_pitch_rad, kMountPitch_rad, 1e-5);
  EXPECT_NEAR(found->mount_yaw_rad, kMountYaw_rad, 1e-5);
  EXPECT_NEAR(found->gps_latency_s, kLatency_s + 0.01, 2e-3);  // the first delays were longer
  EXPECT_NEAR(found->fix_minus_truth_m.y(), 0.5, 1e-2);
  EXPECT_LT(found->residual_along_m, 0.05);
  EXPECT_NEAR(found->raw_rms_m, std::hypot(0.11 * 12.4, 0.5), 0.1);

  const Result<SetupCheck> right = check_setup(import(true_setup()), Duration::zero(), span);
  ASSERT_TRUE(right) << right.error().message;
  EXPECT_NEAR(right->mount_pitch_rad, 0.0, 1e-6);
  EXPECT_NEAR(right->mount_yaw_rad, 0.0, 1e-6);
  EXPECT_NEAR(right->gps_latency_s, 0.0, 2e-3);

  const Result<SetupCheck> none = check_setup(import(nothing), span * 2, span);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("too few"));
}

TEST_F(CommaFolder, ErrorsAreNamed) {
  const auto complaint = [this](const std::string& file, const std::string& text) {
    std::ofstream(folder_ + "/" + file) << text;
    const Result<CommaTables> tables = load_comma2k19(folder_);
    if (!tables) return tables.error().message;
    recording::SensorLog log;
    const Result<CommaCounts> counts = import_comma2k19(*tables, CommaSetup(), &log);
    return counts ? std::string("accepted") : counts.error().message;
  };
  EXPECT_THAT(complaint("imu_gyro.csv", "t,wx,wy\n"), HasSubstr("imu_gyro.csv: no column 'wz'"));
  const std::string header = "t,ecef_x,ecef_y,ecef_z,vx_ecef,vy_ecef,vz_ecef,qw,qx,qy,qz\n";
  EXPECT_THAT(complaint("truth_pose.csv", header + "1,1,2,3,0,0,0,2,0,0,0\n"),
              HasSubstr("truth_pose.csv:2: qw, qx, qy, qz"));
  EXPECT_THAT(complaint("truth_pose.csv", header + "1,1,2,3,0,0,0,1,0,0,0\n"),
              HasSubstr("not a position on the earth"));
  EXPECT_THAT(complaint("truth_pose.csv", header + "1,1,2,,0,0,0,1,0,0,0\n"),
              HasSubstr("no complete row"));
  std::filesystem::remove(folder_ + "/gnss_ublox.csv");
  EXPECT_THAT(complaint("imu_gyro.csv", "t,wx,wy,wz\n"), HasSubstr("gnss_ublox.csv"));
}

}  // namespace
}  // namespace rcs::importers
