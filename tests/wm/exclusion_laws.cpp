#include "tests/wm/exclusion_laws.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <random>
#include <string>

#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

enum class Kind {
  kInsSilence,
  kGyro,
  kForce,
  kGpsBias,
  kGpsRamp,
  kGpsSilence,
  kLadarOffset,
  kLadarTurn,
  kLadarSilence,
  kWheels,
  kCount
};

struct Fault {
  Kind kind = Kind::kCount;
  double begin_s = 0.0, end_s = 0.0, size = 0.0;
  Vec3 axis = Vec3::UnitX();

  [[nodiscard]] bool at(double t_s) const { return t_s >= begin_s && t_s < end_s; }
};

Fault draw(std::mt19937* random) {
  const auto uniform = [random](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(*random);
  };
  Fault f;
  f.kind = static_cast<Kind>(
      std::uniform_int_distribution<int>(0, static_cast<int>(Kind::kCount) - 1)(*random));
  f.begin_s = uniform(25.0, 40.0);
  f.end_s = f.begin_s + uniform(0.2, 15.0);
  f.size = uniform(0.1, 1.0);
  f.axis = Vec3(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0)).normalized();
  return f;
}

class LawfulDrive {
 public:
  explicit LawfulDrive(unsigned seed) : random_(seed), rig_(experiment(seed)) {
    faults_ = {draw(&random_), draw(&random_)};
  }

  void run() {
    const auto& truth = rig_.truth;
    for (std::size_t i = 1; i < truth.size(); ++i) {
      feed(i, seconds(truth[i].stamp - truth[0].stamp));
      const bool started = rig_.estimator.started();
      const Excluded before = started ? rig_.estimator.state().bookkeeping.excluded : Excluded{};
      rig_.estimator.fuse();
      if (started) check(before, seconds(truth[i].stamp - truth[0].stamp));
      rig_.estimator.clear_innovations();
    }
    // A fault that is found in error shortly before the end has its way back, too.
    constexpr double kWayBack_s = 40.0;
    const double end_s = seconds(truth.back().stamp - truth[0].stamp);
    EXPECT_GT(used_s_[0], end_s - kWayBack_s) << "GPS" << text();
    EXPECT_GT(used_s_[1], end_s - kWayBack_s) << "LADAR" << text();
    EXPECT_GT(used_s_[2], end_s - kWayBack_s) << "INS" << text();
    EXPECT_GT(used_s_[3], end_s - kWayBack_s) << "wheels" << text();
  }
  [[nodiscard]] long facts() const { return facts_; }
  [[nodiscard]] int findings() const { return rig_.estimator.fault_detection().findings(); }

 private:
  static Experiment experiment(unsigned seed) {
    Experiment e;
    e.drive.length_s = 120.0;
    e.sensors.seed = seed;
    return e;
  }

  [[nodiscard]] const Fault* at(Kind kind, double t_s) const {
    for (const Fault& f : faults_) {
      if (f.kind == kind && f.at(t_s)) return &f;
    }
    return nullptr;
  }

  void feed(std::size_t i, double t) {
    const Stamp now = rig_.truth[i].stamp;
    Estimator& estimator = rig_.estimator;
    ImuSample imu = rig_.sensors.imu(i);
    const double dt = seconds(imu.interval);
    if (const Fault* f = at(Kind::kGyro, t)) imu.delta_angle += 0.05 * f->size * dt * f->axis;
    if (const Fault* f = at(Kind::kForce, t)) imu.delta_v += 2.0 * f->size * dt * f->axis;
    if (at(Kind::kInsSilence, t) == nullptr) take(estimator.add(imu));
    if (i % 20 == 0) {
      GeodeticFix fix = rig_.sensors.gps(i);
      Vec3 off = Vec3::Zero();
      if (const Fault* f = at(Kind::kGpsBias, t)) off = 50.0 * f->size * f->axis;
      if (const Fault* f = at(Kind::kGpsRamp, t)) off = 4.0 * f->size * (t - f->begin_s) * f->axis;
      fix.antenna = frame_.to_geodetic(frame_.to_world(fix.antenna) + off);
      if (at(Kind::kGpsSilence, t) == nullptr) take(estimator.add(now, fix));
    }
    if (i % 10 == 0) {
      RollingMatch match = rig_.sensors.scan(i);
      Pose& T = match.T_rolling_vehicle;
      if (const Fault* f = at(Kind::kLadarOffset, t)) T.p += 3.0 * f->size * f->axis;
      if (const Fault* f = at(Kind::kLadarTurn, t)) T.q = T.q * exp_so3(0.1 * f->size * f->axis);
      if (at(Kind::kLadarSilence, t) == nullptr) take(estimator.add(now, match));
    }
    if (i % 5 == 0) {
      OdometrySample wheels = rig_.sensors.odometry(i);
      if (const Fault* f = at(Kind::kWheels, t)) wheels.speed_mps += 3.0 * f->size;
      take(estimator.add(now, wheels));
    }
  }
  void take(Reason /*reason*/) { ++facts_; }

  void check(const Excluded& before, double t_s) {
    const FilterState& s = rig_.estimator.state();
    const Excluded& after = s.bookkeeping.excluded;
    // A step that ends an exclusion fuses the inputs of its history again.
    for (const Innovation& k : rig_.estimator.innovations()) {
      if (k.reason != Reason::kAccepted) continue;
      const bool gps = k.source == Source::kGpsPosition || k.source == Source::kGpsVelocity;
      const bool ladar = k.source == Source::kRolling || k.source == Source::kPriorMap;
      EXPECT_FALSE(gps && before.gps && after.gps) << "a fix was fused" << text();
      EXPECT_FALSE(ladar && before.ladar && after.ladar) << "a match was fused" << text();
      const bool wheels = k.source == Source::kOdometry;
      EXPECT_FALSE(wheels && before.wheels && after.wheels) << "a speed was fused" << text();
    }
    EXPECT_FALSE(after.ins && after.force) << text();
    EXPECT_FALSE(after.ins && s.belief.x.inertial) << "the INS was integrated" << text();
    EXPECT_FALSE(after.force && uses_forces(s)) << text();
    const FaultDetection& fault_detection = rig_.estimator.fault_detection();
    const ModeParams& modes = WmParams{}.modes;
    EXPECT_EQ(excluded(fault_detection.ins(s)), after.any_of_ins()) << text();
    EXPECT_EQ(excluded(fault_detection.ladar(s, modes)), after.ladar) << text();
    if (fault_detection.gps(s, modes) != SourceStatus::kNone) {
      EXPECT_EQ(excluded(fault_detection.gps(s, modes)), after.gps) << text();
    }
    if (!after.gps) used_s_[0] = t_s;
    if (!after.ladar) used_s_[1] = t_s;
    if (!after.any_of_ins()) used_s_[2] = t_s;
    if (!after.wheels) used_s_[3] = t_s;
    for (const SourceMonitor SourceMonitors::*monitor :
         {&SourceMonitors::gps, &SourceMonitors::ladar, &SourceMonitors::ins,
          &SourceMonitors::odometry, &SourceMonitors::prior_map}) {
      const SourceState was = (monitors_.*monitor).state();
      const SourceState is = (fault_detection.monitors().*monitor).state();
      const bool fused = was == SourceState::kUsed || was == SourceState::kSuspect;
      EXPECT_FALSE(fused && is == SourceState::kProbation) << text();
    }
    monitors_ = fault_detection.monitors();
    const Cov& P = s.belief.P;
    EXPECT_TRUE(P.diagonal().minCoeff() >= 0.0 && P.allFinite()) << text();
  }

  [[nodiscard]] std::string text() const {
    std::string out;
    for (const Fault& f : faults_) {
      out += ", fault " + std::to_string(static_cast<int>(f.kind)) + " of " +
             std::to_string(f.size) + " from " + std::to_string(f.begin_s) + " to " +
             std::to_string(f.end_s) + " s";
    }
    return out;
  }

  std::mt19937 random_;
  Rig rig_;
  LocalFrame frame_{test_datum()};
  std::array<Fault, 2> faults_;
  std::array<double, 4> used_s_{};  // newest time without an exclusion of GPS, LADAR, INS, wheels
  SourceMonitors monitors_{Duration::zero()};  // before the newest step
  long facts_ = 0;
};

}  // namespace

void expect_laws(unsigned first_seed, int drives) {
  long facts = 0;
  int findings = 0;
  for (int k = 0; k < drives; ++k) {
    SCOPED_TRACE("seed " + std::to_string(first_seed + static_cast<unsigned>(k)));
    LawfulDrive drive(first_seed + static_cast<unsigned>(k));
    drive.run();
    facts += drive.facts();
    findings += drive.findings();
  }
  EXPECT_GT(findings, 0);
  std::printf("%d drives, %ld measurements, %d exclusions and readmissions\n", drives, facts,
              findings);
}

}  // namespace rcs::wm
