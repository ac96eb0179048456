#include "tools/studies/locate_run.h"

#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/sp/scan/column_sampler.h"
#include "rcs/node/log/log_file.h"

namespace rcs::studies {
namespace {

class Reader {
 public:
  Reader(SeenDrive* drive, double column_m) : drive_(drive), column_m_(column_m) {}

  void take(const LogEvent& event) {
    if (event.channel == channel::kSpPoints) {
      with(event, &points_, [this] { add_points(); });
    } else if (event.channel == channel::kWmNavState) {
      with(event, &nav_state_, [this] { add_belief(); });
    } else if (event.channel == channel::kSimTruth) {
      with(event, &truth_, [this] { add_truth(); });
    }
  }

 private:
  template <class Message, class Add>
  void with(const LogEvent& event, Message* message, Add add) {
    const int size = static_cast<int>(event.data.size());
    if (message->decode(event.data.data(), 0, size) == size) add();
  }

  void add_belief() {
    Pose T_local_vehicle, T_rolling_vehicle;
    T_level_rolling_.reset();
    if (nav_state_.rolling_valid == 0 ||
        !from_message(nav_state_.q_local_vehicle, nav_state_.p_local_vehicle_m, &T_local_vehicle) ||
        !from_message(nav_state_.q_rolling_vehicle, nav_state_.p_rolling_vehicle_m,
                      &T_rolling_vehicle)) {
      return;
    }
    T_level_rolling_ = T_local_vehicle * T_rolling_vehicle.inverse();
    epoch_ = nav_state_.map_epoch;
  }

  void add_points() {
    Pose T_rolling_vehicle;
    if (!T_level_rolling_ || points_.map_epoch != epoch_ ||
        !from_message(points_.q_rolling_vehicle, points_.p_rolling_vehicle_m, &T_rolling_vehicle)) {
      return;
    }
    if (points_.part == 0) all_.clear();
    for (std::size_t k = 0; k < points_.x_m.size(); ++k) {
      const Vec3f p(points_.x_m[k], points_.y_m[k], points_.z_m[k]);
      if (p.allFinite()) all_.push_back(p);
    }
    if (points_.part + 1 < points_.part_count) return;
    SeenScan scan;
    scan.stamp = from_utime(points_.utime);
    if (!drive_->scans.empty() && scan.stamp <= drive_->scans.back().stamp) return;
    scan.T_level_vehicle = *T_level_rolling_ * T_rolling_vehicle;
    sampler_.sample(all_, scan.T_level_vehicle.q.conjugate() * Vec3::UnitZ(), column_m_,
                    &scan.lowest_vehicle);
    drive_->scans.push_back(std::move(scan));
  }

  void add_truth() {
    Pose T;
    const Stamp stamp = from_utime(truth_.utime);
    if (!from_message(truth_.q_world_vehicle, truth_.p_world_vehicle_m, &T)) return;
    if (!drive_->truth.empty() && stamp <= drive_->truth.back().stamp) return;
    drive_->truth.push_back({stamp, T});
    drive_->truth_datum = Geodetic{
        radians(truth_.datum_lat_deg), radians(truth_.datum_lon_deg), {truth_.datum_height_m}};
  }

  SeenDrive* drive_;
  double column_m_;
  sp::ColumnSampler sampler_;
  Points all_;
  std::optional<Pose> T_level_rolling_;
  std::int32_t epoch_ = 0;
  points_t points_{};
  nav_state_t nav_state_{};
  truth_t truth_{};
};

}  // namespace

Result<SeenDrive> read_drive(const std::string& path, double column_m) {
  Result<LogReader> reader = LogReader::open(path);
  if (!reader) return reader.error();
  SeenDrive drive;
  Reader scans(&drive, column_m);
  LogEvent event;
  while (reader->next(&event)) scans.take(event);
  if (drive.scans.empty()) {
    return Error{path + ": no SP_POINTS after a WM_NAV_STATE; use a log written by `rcs replay`"};
  }
  return drive;
}

LocateResult locate(const SeenDrive& drive, std::size_t first, Duration length,
                    const ElevationMap& map, const sp::StartRegion& region, WorkUnits per_scan,
                    sp::InitialLocalizer* localizer, const std::function<bool(double)>& progress) {
  LocateResult result;
  if (!localizer->begin(region)) {
    result.status = localizer->status();
    return result;
  }
  const Stamp from = drive.scans[first].stamp;
  std::size_t k = first;
  for (; k < drive.scans.size() && drive.scans[k].stamp - from <= length; ++k) {
    const double share = seconds(drive.scans[k].stamp - from) / seconds(length);
    if (!progress(std::min(share, 1.0))) break;
    localizer->add(drive.scans[k].lowest_vehicle, drive.scans[k].T_level_vehicle);
    result.used += localizer->work(map, per_scan);
    if (localizer->status().state == sp::InitialLocalizationState::kFound) break;
  }
  const SeenScan& newest = drive.scans[std::min(k, drive.scans.size() - 1)];
  result.status = localizer->status();
  result.stamp = newest.stamp;
  result.after_s = seconds(newest.stamp - from);
  result.T_map_vehicle = result.status.T_map_level * newest.T_level_vehicle;
  result.covariance = localizer->covariance_at(newest.T_level_vehicle);
  return result;
}

}  // namespace rcs::studies
