#include "tools/view/source/scan_pair.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/base/kd_tree.h"
#include "tools/clouds/cloud_file.h"
#include "tools/studies/cloud_match.h"
#include "tools/view/source/pose_history.h"

namespace rcs::view {
namespace {

using Json = nlohmann::ordered_json;

/// Scans are searched for within this time before the moment.
constexpr Duration kSearch = std::chrono::seconds(60);
constexpr Duration kPoses = std::chrono::seconds(1);

struct SpScan {
  std::int64_t scan_id = 0;
  std::int64_t utime = 0;
  clouds::Cloud cloud;
};

/// The newest complete scans, newest first.
std::vector<SpScan> newest_scans(LogIndex* index, Duration time, std::size_t wanted) {
  static const ChannelSet kPoints = channels_of(channel::kSpPoints);
  const std::vector<std::size_t> events = index->recent(time, kSearch, kPoints);
  std::vector<SpScan> scans;
  SpScan scan;
  int parts = 0;
  LogEvent event;
  for (auto e = events.rbegin(); e != events.rend() && scans.size() < wanted; ++e) {
    points_t m{};
    if (!index->read(*e, &event)) continue;
    const int bytes = static_cast<int>(event.data.size());
    if (m.decode(event.data.data(), 0, bytes) != bytes || m.y_m.size() != m.x_m.size() ||
        m.z_m.size() != m.x_m.size()) {
      continue;
    }
    if (parts == 0 || m.scan_id != scan.scan_id) {
      scan = {m.scan_id, m.utime, {}};
      parts = 0;
    }
    for (std::size_t i = 0; i < m.x_m.size(); ++i) {
      const Vec3f p(m.x_m[i], m.y_m[i], m.z_m[i]);
      if (p.allFinite()) scan.cloud.points.push_back(p);
    }
    if (++parts < m.part_count) continue;
    parts = 0;
    (void)clouds::drop_coincident(&scan.cloud);
    if (!scan.cloud.points.empty()) scans.push_back(std::move(scan));
    scan = {};
  }
  return scans;
}

std::optional<Pose> motion_by_wm(LogIndex* index, Duration time, const SpScan& model,
                                 const SpScan& data) {
  static const ChannelSet kNav = channels_of(channel::kWmNavState);
  PoseHistory poses((kSearch + 2 * kPoses).count());
  LogEvent event;
  for (const std::size_t e : index->recent(time + kPoses, kSearch + kPoses, kNav)) {
    if (index->read(e, &event)) poses.add_nav_state(event.data.data(), event.data.size());
  }
  const std::optional<Pose> T_world_model = poses.at(model.utime);
  const std::optional<Pose> T_world_data = poses.at(data.utime);
  if (!T_world_model || !T_world_data) return std::nullopt;
  return T_world_model->inverse() * *T_world_data;
}

Json to_json(const SpScan& scan) {
  Json xyz = Json::array();
  const Points& p = scan.cloud.points;
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (const float v : {p.x[i], p.y[i], p.z[i]}) xyz.push_back(v);
  }
  return {{"scan_id", scan.scan_id},
          {"utime", scan.utime},
          {"points", p.size()},
          {"xyz", std::move(xyz)}};
}

Json to_json(const Pose& T) {
  const Eigen::Matrix4d m = T.matrix();
  Json rows = Json::array();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) rows.push_back(m(i, j));
  }
  return rows;
}

Json to_json(const studies::ClosestPoints& closest) {
  return {
      {"mean_m", closest.mean_m()}, {"index", closest.index}, {"distance_m", closest.distance_m}};
}

}  // namespace

Result<Json> scan_pair(LogIndex* index, const ScanPairRequest& request) {
  const auto apart = static_cast<std::size_t>(std::clamp(request.apart, 1, kMaxApart));
  const std::vector<SpScan> scans = newest_scans(index, request.time, apart + 1);
  if (scans.size() < 2) {
    return Error{
        fmt::format("the log has {} complete scans of SP_POINTS in the {:.0f} s before "
                    "{:.2f} s; two are needed",
                    scans.size(), seconds(kSearch), seconds(request.time))};
  }
  const SpScan& data = scans.front();
  const SpScan& model = scans.back();
  Pose guess;
  if (request.guess_by_wm) {
    const std::optional<Pose> motion = motion_by_wm(index, request.time, model, data);
    if (!motion) return Error{"the log has no poses of WM for the guess"};
    guess = *motion;
  }
  const studies::CloudMatch match = studies::match_planes(model.cloud.points, data.cloud.points,
                                                          guess, registration::CloudParams{});
  const KdTree tree(model.cloud.points);
  Json out = {
      {"method", "plane"},
      {"guess_by", request.guess_by_wm ? "WM" : "identity"},
      {"apart", scans.size() - 1},
      {"model", to_json(model)},
      {"data", to_json(data)},
      {"guess", to_json(guess)},
      {"T_model_data", to_json(match.T_model_data)},
      {"stop", match.stop},
      {"accepted", match.good},
      {"iterations", match.iterations},
      {"pairs", match.pairs},
      {"overlap", match.overlap},
      {"cpu_ms", match.total_ms()},
      {"before", to_json(studies::closest_points(tree, data.cloud.points, guess))},
      {"after", to_json(studies::closest_points(tree, data.cloud.points, match.T_model_data))}};
  if (match.planes) out["mean_distance_to_planes_m"] = match.planes->mean_distance_m;
  return out;
}

}  // namespace rcs::view
