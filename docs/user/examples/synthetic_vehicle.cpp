// A vehicle that does not exist: it publishes INS, GPS_FIX, ODOMETRY and LADAR_POINTS as four
// drivers of real sensors would, and prints the pose that WM publishes next to the truth. It
// stands for 3 s and then drives in a circle of 12 m in a courtyard with four walls.
//   synthetic_vehicle [SECONDS]       (default: 60). docs/user/own_vehicle.md explains every choice
//   here.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <string>
#include <thread>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadius_m = 12.0, kSpeed_mps = 4.0, kStand_s = 3.0, kAccel_mps2 = 1.0,
                 kGravity_mps2 = 9.81;
constexpr double kLever_m[2] = {-0.5, 1.1};  // antenna: x and z in the vehicle, [gps] lever_m
constexpr double kMount_m[2] = {0.3, 1.2};   // LADAR: x and z in the vehicle, [ladar] mount_m
constexpr double kGround_m = -0.6;           // z of the ground in the vehicle frame
constexpr const char* kModes[] = {"ALIGN",  "GPS_INS",   "GPS_INS_LADAR", "INS_LADAR",
                                  "INS_DR", "GPS_LADAR", "LADAR",         "LOST"};
constexpr int kTick_us = 5000, kFacets = 20, kBeams = 32, kColumns = 18;  // INS 200 Hz, scans 10 Hz

struct Motion {
  double x, y, yaw, speed, path;
};
Motion motion_at(double t_s) {  // frame world: x east, y north; the circle's centre is at (0, 12)
  const double t = std::max(0.0, t_s - kStand_s), ramp = kSpeed_mps / kAccel_mps2,
               up = std::min(t, ramp);
  const double path = 0.5 * kAccel_mps2 * up * up + kSpeed_mps * (t - up);
  const double yaw = path / kRadius_m;
  return {kRadius_m * std::sin(yaw), kRadius_m * (1.0 - std::cos(yaw)), yaw, kAccel_mps2 * up,
          path};
}

// Range along a ray from (x, y), kMount_m[1] above the vehicle's origin; 0: it passes over the
// walls.
double range_of(double x, double y, double dx, double dy, double dz) {
  double range_m = dz < 0.0 ? (kGround_m - kMount_m[1]) / dz : 1e9;
  if (dx != 0.0) range_m = std::min(range_m, ((dx > 0.0 ? 35.0 : -35.0) - x) / dx);
  if (dy != 0.0) range_m = std::min(range_m, ((dy > 0.0 ? 37.0 : -13.0) - y) / dy);
  return kMount_m[1] + range_m * dz > kGround_m + 6.0 ? 0.0 : range_m;  // walls of 6 m
}

/// The newest message on WM_NAV_STATE.
struct Receiver {
  rcs::nav_state_t nav{};
  void receive(const lcm::ReceiveBuffer*, const std::string&, const rcs::nav_state_t* m) {
    nav = *m;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const double length_s = argc > 1 ? std::atof(argv[1]) : 60.0;
  lcm::LCM bus("udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304");
  if (!bus.good()) return 1;
  Receiver wm;
  bus.subscribe("WM_NAV_STATE", &Receiver::receive, &wm);
  std::mt19937 rng(1);
  std::normal_distribution<double> noise;
  rcs::ins_t ins{};
  rcs::gps_fix_t fix{};
  rcs::odometry_t wheels{};
  rcs::ladar_points_t facet{};
  ins.publisher_id = fix.publisher_id = wheels.publisher_id = facet.publisher_id = getpid();

  // One clock for all sensors: microseconds of CLOCK_MONOTONIC. Any other epoch would do as well.
  const auto begin = std::chrono::steady_clock::now();
  const std::int64_t begin_us =
      std::chrono::duration_cast<std::chrono::microseconds>(begin.time_since_epoch()).count();
  for (std::int64_t k = 1; k * kTick_us * 1e-6 <= length_s; ++k) {
    std::this_thread::sleep_until(begin + std::chrono::microseconds(k * kTick_us));
    const std::int64_t now_us = begin_us + k * kTick_us;
    const double t = k * kTick_us * 1e-6, dt = kTick_us * 1e-6;
    const Motion m = motion_at(t), before = motion_at(t - dt);

    // INS: integrals over the interval that ends at utime, in vehicle axes (x ahead, y left, z up).
    // At rest delta_v is +g up. (A real gyro also measures the rotation of the earth; grade
    // "industrial" covers that.) The gyro has noise: WM rejects increments that repeat.
    ins.utime = now_us, ++ins.seq, ins.interval_us = kTick_us, ins.valid = 1;
    ins.delta_angle_rad[2] = m.yaw - before.yaw + 1e-6 * noise(rng);
    ins.delta_v_mps[0] = m.speed - before.speed;
    ins.delta_v_mps[1] = m.speed * m.speed / kRadius_m * dt;
    ins.delta_v_mps[2] = kGravity_mps2 * dt;
    bus.publish("INS", &ins);

    if (k % 20 == 0) {  // wheels, 10 Hz: the mean over the interval that ends at utime
      wheels.utime = now_us, ++wheels.seq, wheels.interval_us = 20 * kTick_us;
      wheels.speed_mps = (m.path - motion_at(t - 20 * dt).path) / (20 * dt);
      wheels.yaw_rate_radps = wheels.speed_mps / kRadius_m;
      wheels.sigma_speed_mps = 0.05, wheels.sigma_yaw_rate_radps = 0.02;
      bus.publish("ODOMETRY", &wheels);
    }
    if (k % 40 == 0) {  // GPS, 5 Hz: the antenna, at the instant of validity, with the true sigma
      const double lat = 40.0 * kPi / 180.0, w2 = 1.0 - 6.69438e-3 * std::sin(lat) * std::sin(lat);
      const double east = m.x + kLever_m[0] * std::cos(m.yaw) + 0.02 * noise(rng);
      const double north = m.y + kLever_m[0] * std::sin(m.yaw) + 0.02 * noise(rng);
      fix.utime = now_us, ++fix.seq, fix.fix_type = rcs::gps_fix_t::FIX_FIXED, fix.satellites = 14;
      fix.lat_deg =
          40.0 + north / (6378137.0 * (1.0 - 6.69438e-3) / std::pow(w2, 1.5)) * 180.0 / kPi;
      fix.lon_deg = -77.0 + east / (6378137.0 / std::sqrt(w2) * std::cos(lat)) * 180.0 / kPi;
      fix.height_kind = rcs::gps_fix_t::HEIGHT_ELLIPSOIDAL, fix.undulation_m = std::nan("");
      fix.height_m = 200.0 + kLever_m[1] + 0.03 * noise(rng);
      fix.sigma_enu_m[0] = fix.sigma_enu_m[1] = 0.02, fix.sigma_enu_m[2] = 0.03;
      fix.has_velocity = 0, fix.hdop = 0.8, fix.vdop = 1.2;
      bus.publish("GPS_FIX", &fix);
    }

    // LADAR: a spinning scanner. Every 5 ms one sector of 18 deg goes out, stamped with its first
    // shot; dt_us is the shot's time after that, reference_utime the middle of the turn for all of
    // its sectors. Scans are numbered by time, so that the numbers also grow over a restart of this
    // program.
    const std::int64_t scan = (k - 1) / kFacets;
    facet.scan_id = begin_us / (kFacets * kTick_us) + scan;
    facet.facet = static_cast<std::int16_t>((k - 1) % kFacets);
    facet.utime = now_us - kTick_us, ++facet.seq, facet.facet_count = kFacets, facet.sensor_id = 0;
    facet.reference_utime = begin_us + (scan * kFacets + kFacets / 2) * kTick_us;
    facet.x_m.clear(), facet.y_m.clear(), facet.z_m.clear(), facet.dt_us.clear();
    for (int column = 0; column < kColumns; ++column) {
      const int dt_us = kTick_us * column / kColumns;
      const Motion at = motion_at(t - dt + 1e-6 * dt_us);
      const double azimuth = kPi - (facet.facet * kColumns + column) * kPi / 180.0;  // clockwise
      for (int beam = 0; beam < kBeams; ++beam) {
        const double elevation = (-24.0 + 1.25 * beam) * kPi / 180.0;
        const double c = std::cos(elevation), yaw = at.yaw + azimuth;
        const double range_m =
            range_of(at.x + kMount_m[0] * std::cos(at.yaw), at.y + kMount_m[0] * std::sin(at.yaw),
                     c * std::cos(yaw), c * std::sin(yaw), std::sin(elevation));
        if (range_m == 0.0) continue;
        const double r = range_m + 0.02 * noise(rng);
        facet.x_m.push_back(static_cast<float>(r * c * std::cos(azimuth)));  // ladar frame
        facet.y_m.push_back(static_cast<float>(r * c * std::sin(azimuth)));
        facet.z_m.push_back(static_cast<float>(r * std::sin(elevation)));
        facet.dt_us.push_back(dt_us);
      }
    }
    facet.n = facet.n_time = static_cast<std::int32_t>(facet.x_m.size()), facet.n_index = 0;
    bus.publish("LADAR_POINTS", &facet);

    while (bus.handleTimeout(0) > 0) {
    }
    if (k % 200 != 0 || wm.nav.utime == 0) continue;  // once a second
    const Motion truth = motion_at(1e-6 * static_cast<double>(wm.nav.utime - begin_us));
    std::printf("%5.1f s, %s, mode %s: %7.2f %7.2f %6.2f m; truth %7.2f %7.2f\n", t,
                wm.nav.world_valid != 0 ? "world" : "local", kModes[wm.nav.mode & 7],
                wm.nav.p_world_vehicle_m[0], wm.nav.p_world_vehicle_m[1],
                wm.nav.p_world_vehicle_m[2], truth.x, truth.y);
    std::fflush(stdout);
  }
  return 0;
}
