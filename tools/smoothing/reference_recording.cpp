#include "tools/smoothing/reference_recording.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/executor.h"
#include "rcs/node/log/log_source.h"
#include "rcs/prior/prior_terrain.h"
#include "tools/evaluation/evaluation.h"

namespace rcs::smoothing {
namespace {

/// A log, until a stop is requested.
class StoppableLog final : public EventSource {
 public:
  StoppableLog(EventSource* source, const LogReader* reader,
               const std::function<void(std::int64_t, std::int64_t)>& progress,
               const std::function<bool()>& stop)
      : source_(source), reader_(reader), progress_(progress), stop_(stop) {}

  [[nodiscard]] Stamp peek() override { return stop_() ? Stamp::max() : source_->peek(); }
  void take(SourceEvent* event) override {
    source_->take(event);
    progress_(reader_->position_bytes(), reader_->size_bytes());
  }

 private:
  EventSource* source_;
  const LogReader* reader_;
  const std::function<void(std::int64_t, std::int64_t)>& progress_;
  const std::function<bool()>& stop_;
};

class Recorder final : public BusTap {
 public:
  void on_deliver(Stamp /*due*/, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override {
    if (channel == channel::kSpPoints) {
      with(data, size, &points_);
    } else if (channel == channel::kSpRegistration) {
      with(data, size, &registration_);
    } else if (channel == channel::kWmNavState) {
      with(data, size, &nav_);
    } else if (channel == channel::kIns) {
      with(data, size, &ins_);
    } else if (channel == channel::kGpsFix) {
      with(data, size, &fix_);
    } else if (channel == channel::kOdometry) {
      with(data, size, &odometry_);
    } else if (channel == channel::kSimTruth) {
      with(data, size, &truth_);
    }
  }

  /// Converts the fixes to frame world, after its datum is known.
  ReferenceRecording take() {
    for (const auto& [fix, place] : places_) {
      RecordedFix f = fix;
      if (record_.datum) f.p_world = LocalFrame(*record_.datum).to_world(place);
      if (record_.datum) record_.fixes.push_back(f);
    }
    if (record_.datum && truth_datum_) {
      const Pose T = LocalFrame(*record_.datum).from(LocalFrame(*truth_datum_));
      for (tools::StampedPose& p : record_.sim_truth) p.T = T * p.T;
    }
    return std::move(record_);
  }

 private:
  template <class T>
  void with(const std::uint8_t* data, std::size_t size, T* message) {
    const int n = static_cast<int>(size);
    if (message->decode(data, 0, n) != n || !take(*message)) ++record_.refused;
  }

  bool take(const points_t& m) {
    const Stamp reference = from_utime(m.utime);
    std::vector<RecordedScan>& scans = record_.scans;
    const bool continues = !scans.empty() && reference == scans.back().reference;
    if (!continues && !scans.empty() && reference < scans.back().reference) return false;
    if (!continues) scans.push_back({reference, {}});
    Points& points = scans.back().points_vehicle;
    for (std::size_t i = 0; i < m.x_m.size(); ++i) {
      const Vec3f p(m.x_m[i], m.y_m[i], m.z_m[i]);
      if (p.allFinite()) points.push_back(p);
    }
    return true;
  }

  bool take(const registration_t& m) {
    if (m.target != registration_t::TARGET_ROLLING || !is_answer(m.stop)) return true;
    RecordedMatch match{from_utime(m.utime), m.map_epoch, {}};
    std::vector<RecordedMatch>& all = record_.matches;
    if (!from_message(m.q_target_vehicle, m.p_target_vehicle_m, &match.T_rolling_vehicle)) {
      return false;
    }
    if (!all.empty() && match.reference <= all.back().reference) return false;
    all.push_back(match);
    return true;
  }

  bool take(const nav_state_t& m) {
    RecordedBelief b;
    b.stamp = from_utime(m.utime);
    const bool sound = plausible_motion(m) &&
                       from_message(m.q_world_vehicle, m.p_world_vehicle_m, &b.T_world_vehicle) &&
                       from_message(m.q_local_vehicle, m.p_local_vehicle_m, &b.T_local_vehicle);
    if (!sound) return false;
    // A later message about the same instant is more accurate.
    if (!record_.beliefs.empty() && b.stamp < record_.beliefs.back().stamp) return false;
    if (!record_.beliefs.empty() && b.stamp == record_.beliefs.back().stamp) {
      record_.beliefs.pop_back();
    }
    b.world_valid = m.world_valid != 0;
    b.cov_world_pose = from_message<6>(m.cov_world_pose);
    b.v_vehicle = b.T_world_vehicle.q.conjugate() * from_message(m.v_world_mps);
    b.rate_vehicle = from_message(m.rate_vehicle_radps);
    b.gyro_bias = from_message(m.gyro_bias_radps);
    b.accel_bias = from_message(m.accel_bias_mps2);
    const Geodetic datum{radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}};
    if (b.world_valid && plausible(datum)) record_.datum = datum;
    record_.beliefs.push_back(b);
    return true;
  }

  bool take(const ins_t& m) {
    if (!plausible(m)) return false;
    std::vector<InertialIncrement>& all = record_.inertial;
    const Stamp end = from_utime(m.utime);
    if (!all.empty() && end <= all.back().end) return false;
    all.push_back(
        {end, 1e-6 * m.interval_us, from_message(m.delta_angle_rad), from_message(m.delta_v_mps)});
    return true;
  }

  bool take(const gps_fix_t& m) {
    RecordedFix f;
    f.stamp = from_utime(m.utime);
    double height_m = m.height_m;
    if (m.height_kind == gps_fix_t::HEIGHT_ORTHOMETRIC) height_m += m.undulation_m;
    const Geodetic place{radians(m.lat_deg), radians(m.lon_deg), {height_m}};
    f.sigma_m = from_message(m.sigma_enu_m);
    f.sigma_mps = from_message(m.sigma_v_enu_mps);
    f.v_world = from_message(m.v_enu_mps);
    const bool sound = m.fix_type != gps_fix_t::FIX_NONE && plausible_stamp(m.utime) &&
                       plausible(place) && f.sigma_m.allFinite() && f.sigma_m.minCoeff() > 0.0;
    if (!sound || (!places_.empty() && f.stamp <= places_.back().first.stamp)) return false;
    f.has_velocity = m.has_velocity != 0 && within(f.v_world, kFastest_mps) &&
                     f.sigma_mps.allFinite() && f.sigma_mps.minCoeff() > 0.0;
    places_.emplace_back(f, place);
    return true;
  }

  bool take(const odometry_t& m) {
    const Stamp end = from_utime(m.utime);
    const bool sound = plausible_stamp(m.utime) && std::abs(m.speed_mps) <= kFastest_mps &&
                       m.sigma_speed_mps > 0.0 && m.interval_us >= 0 && m.interval_us < 1'000'000;
    if (!sound || (!record_.wheels.empty() && end <= record_.wheels.back().end)) return false;
    record_.wheels.push_back({end, 1e-6 * m.interval_us, m.speed_mps, m.sigma_speed_mps});
    return true;
  }

  bool take(const truth_t& m) {
    tools::StampedPose p{from_utime(m.utime), {}};
    if (!from_message(m.q_world_vehicle, m.p_world_vehicle_m, &p.T)) return false;
    if (!record_.sim_truth.empty() && p.stamp <= record_.sim_truth.back().stamp) return false;
    truth_datum_ = Geodetic{radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}};
    record_.sim_truth.push_back(p);
    return true;
  }

  ReferenceRecording record_;
  std::vector<std::pair<RecordedFix, Geodetic>> places_;
  std::optional<Geodetic> truth_datum_;
  points_t points_{};
  registration_t registration_{};
  nav_state_t nav_{};
  ins_t ins_{};
  gps_fix_t fix_{};
  odometry_t odometry_{};
  truth_t truth_{};
};

/// Without an INS WM extrapolates between two scans, and the poses of SP are more accurate. Frame
/// local is then the rolling map of SP, with the last estimate of WM of its pose in frame world.
void take_motion_from_scans(ReferenceRecording* r) {
  if (!r->inertial.empty() || r->matches.size() < 3 || r->beliefs.empty()) return;
  const std::vector<RecordedMatch>& all = r->matches;
  if (all.front().map_epoch != all.back().map_epoch) return;
  const RecordedBelief last = r->beliefs.back();
  const Pose T_world_rolling = last.T_world_vehicle * all.back().T_rolling_vehicle.inverse();
  std::vector<RecordedBelief> beliefs;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const RecordedMatch& from = all[k == 0 ? 0 : k - 1];
    const RecordedMatch& to = all[std::min(k + 1, all.size() - 1)];
    const Vec6 twist = log_se3(from.T_rolling_vehicle.inverse() * to.T_rolling_vehicle) /
                       seconds(to.reference - from.reference);
    RecordedBelief b = last;
    b.stamp = all[k].reference;
    b.T_local_vehicle = all[k].T_rolling_vehicle;
    b.T_world_vehicle = last.world_valid ? T_world_rolling * b.T_local_vehicle : b.T_local_vehicle;
    b.v_vehicle = twist.head<3>();
    b.rate_vehicle = twist.tail<3>();
    beliefs.push_back(b);
  }
  r->beliefs = std::move(beliefs);
}

}  // namespace

Result<ReferenceRecording> record_run(
    const std::string& log, const ReferenceVehicle& vehicle,
    const std::function<void(std::int64_t, std::int64_t)>& progress,
    const std::function<bool()>& stop) {
  Result<LogReader> reader = LogReader::open(log);
  if (!reader) return reader.error();
  Result<PriorTerrain> prior = open_prior_terrain(vehicle.sp.prior_terrain, false);
  if (!prior) return prior.error();
  LocalBus bus;
  Recorder recorder;
  bus.set_tap(&recorder);
  sp::SpNode sp_node(vehicle.sp, std::move(prior).value(), &bus);
  wm::WmNode wm_node(vehicle.wm, &bus);
  std::vector<std::string> channels(channel::kSensors.begin(), channel::kSensors.end());
  channels.emplace_back(channel::kSimTruth);
  LogSource whole(&reader.value(), channels);
  StoppableLog source(&whole, &reader.value(), progress, stop);
  LockstepTimeline timeline(&bus, &source, kReplayTail);
  (void)rcs::run({&sp_node, &wm_node}, timeline, nullptr);
  if (stop()) return Error{"interrupted"};
  if (whole.fed() == 0) return Error{log + ": no sensor data"};
  ReferenceRecording recording = recorder.take();
  if (!reader->health().good()) recording.damage = reader->health().summary();
  if (recording.scans.empty()) return Error{log + ": no usable scans"};
  if (recording.beliefs.empty()) return Error{log + ": WM never published a valid pose"};
  take_motion_from_scans(&recording);
  return recording;
}

}  // namespace rcs::smoothing
