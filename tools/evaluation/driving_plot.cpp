#include "tools/evaluation/driving_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "rcs/base/pose.h"
#include "rcs/node/log/log_file.h"

namespace rcs::evaluation {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kHighest_m = 1.0;  // of the scale of colours
constexpr double kBeside_m = 12.0;  // of the course: what is shown
constexpr double kEveryPath_s = 1.0;
constexpr double kEveryLevel_m = 15.0;  // of the course: a circle
constexpr double kLargestLevel_m = 100.0;
constexpr int kCorners = 24;

struct Curve {
  std::vector<double> x, y;

  void add(double px, double py) {
    x.push_back(px);
    y.push_back(py);
  }
  void interrupt() {
    if (!x.empty()) add(kNone, kNone);
  }
};

/// Collects one frame local: another one begins from the start.
class Drive {
 public:
  void accept(const nav_state_t& m) {
    if (!from_message(m.q_local_vehicle, m.p_local_vehicle_m, &T_local_vehicle_)) return;
    if (m.local_utime != local_utime_) *this = Drive(m.local_utime, T_local_vehicle_, level_m_);
    const Vec3& p = T_local_vehicle_.p;
    Pose T_world_vehicle;
    if (m.world_valid != 0 &&
        from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle)) {
      T_local_world_ = T_local_vehicle_ * T_world_vehicle.inverse();
    }
    const bool moved =
        course_.x.empty() || std::hypot(p.x() - course_.x.back(), p.y() - course_.y.back()) > 0.2;
    if (!moved) return;
    if (!course_.x.empty()) {
      driven_m_ += std::hypot(p.x() - course_.x.back(), p.y() - course_.y.back());
    }
    course_.add(p.x(), p.y());
    if (driven_m_ < next_level_m_ || !(level_m_ < kLargestLevel_m)) return;
    next_level_m_ = driven_m_ + kEveryLevel_m;
    levels_.interrupt();
    for (int k = 0; k <= kCorners; ++k) {
      const double angle = 2.0 * M_PI * k / kCorners;
      levels_.add(p.x() + level_m_ * std::cos(angle), p.y() + level_m_ * std::sin(angle));
    }
  }

  void accept(const integrity_t& m) { level_m_ = m.protection_horizontal_m; }

  void accept(const map_patch_t& m) {
    constexpr int kFarthest = 1'000'000;  // cells
    const bool good = m.local_utime == local_utime_ && m.width > 0 && m.cell_m > 0.0 &&
                      std::abs(m.first_i) < kFarthest && std::abs(m.first_j) < kFarthest;
    if (!good) return;
    cell_m_ = m.cell_m;
    for (int k = 0; k < m.n; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const std::pair<int, int> cell{m.first_j + k / m.width, m.first_i + k % m.width};
      if ((static_cast<std::uint8_t>(m.flags[at]) & map_patch_t::FLAG_OBSTACLE) != 0) {
        obstacles_[cell] = std::clamp(0.01 * m.step_cm[at], 0.0, kHighest_m);
      } else {
        obstacles_.erase(cell);  // it was seen better
      }
    }
  }

  void accept(const plan_t& m) {
    const double t_s = 1e-6 * static_cast<double>(m.utime);
    if (m.point.empty() || t_s < next_path_s_) return;
    next_path_s_ = t_s + kEveryPath_s;
    paths_.interrupt();
    for (const plan_point_t& p : m.point) paths_.add(p.p_m[0], p.p_m[1]);
  }

  /// The candidates of all choices, by the pose in frame world at each.
  void accept(const routes_t& m) {
    choices_.push_back(m);
    for (const route_t& r : m.route) {
      Curve& curve = r.verdict == route_t::VERDICT_CHOSEN ? chosen_ : others_;
      curve.interrupt();
      for (std::size_t k = 0; k < std::min(r.x_m.size(), r.y_m.size()); ++k) {
        const Vec3 p = T_local_world_ * Vec3(r.x_m[k], r.y_m[k], 0.0);
        curve.add(p.x(), p.y());
      }
    }
  }

  /// @param task  of the mission, whose places are shown instead of those along its routes
  void accept(const command_t& m, bool task) {
    if (m.kind != command_t::KIND_GOTO && m.kind != command_t::KIND_FOLLOW) return;
    if (has_task_ && !task) return;
    if (task && !has_task_) waypoints_.clear();
    has_task_ = has_task_ || task;
    std::vector<Vec3> places;
    for (const waypoint_t& w : m.waypoint) {
      const Vec3 p = from_message(w.p_m);
      if (!p.allFinite()) return;
      places.push_back(m.frame == command_t::FRAME_WORLD ? T_local_world_ * p : p);
    }
    if (places.size() >= waypoints_.size()) waypoints_ = std::move(places);
  }

  [[nodiscard]] std::optional<DrivingRecord> record() && {
    if (paths_.x.empty() || course_.x.size() < 2) return std::nullopt;
    using report::Colour;
    using report::SeriesStyle;
    report::Plot out = report::view_from_above("The drive from above, frame local", false, 620);
    const auto [x_low, x_high] = std::minmax_element(course_.x.begin(), course_.x.end());
    const auto [y_low, y_high] = std::minmax_element(course_.y.begin(), course_.y.end());
    out.window = report::Window{*x_low - kBeside_m, *x_high + kBeside_m, *y_low - kBeside_m,
                                *y_high + kBeside_m};
    out.map = report::CellMap{cell_m_, {}, "obstacle [m]", false};
    const auto show = [&out](double x, double y) {
      if (!std::isfinite(x) || !std::isfinite(y)) return;
      out.window->x_low = std::min(out.window->x_low, x - kBeside_m);
      out.window->x_high = std::max(out.window->x_high, x + kBeside_m);
      out.window->y_low = std::min(out.window->y_low, y - kBeside_m);
      out.window->y_high = std::max(out.window->y_high, y + kBeside_m);
    };
    for (const Vec3& w : waypoints_) show(w.x(), w.y());
    for (const Curve* routes : {&chosen_, &others_}) {
      for (std::size_t k = 0; k < routes->x.size(); ++k) show(routes->x[k], routes->y[k]);
    }
    for (const auto& [at, value] : obstacles_) {
      out.map->cells.push_back({at.second, at.first, value});
    }
    for (std::size_t k = 0; k < waypoints_.size(); ++k) {
      out.marks.push_back({waypoints_[k].x(), waypoints_[k].y(), std::to_string(k + 1)});
    }
    const auto add = [&out](const char* label, Colour colour, SeriesStyle style, Curve* curve) {
      if (curve->x.empty()) return;
      out.series.push_back({label, colour, style, std::move(curve->x), std::move(curve->y), {}});
    };
    add("paths of BG, one a second", Colour::kPurple, SeriesStyle::kHair, &paths_);
    add("protection level", Colour::kOrange, SeriesStyle::kHair, &levels_);
    add("other routes", Colour::kGrey, SeriesStyle::kDashed, &others_);
    add("chosen routes", Colour::kGreen, SeriesStyle::kDashed, &chosen_);
    add("course by WM", Colour::kBlue, SeriesStyle::kThickLine, &course_);
    return DrivingRecord{std::move(out), std::move(choices_)};
  }

  Drive() = default;

 private:
  Drive(std::int64_t local_utime, const Pose& T_local_vehicle, double level_m)
      : local_utime_(local_utime), T_local_vehicle_(T_local_vehicle), level_m_(level_m) {}

  std::int64_t local_utime_ = -1;
  Pose T_local_vehicle_;
  Pose T_local_world_;
  double level_m_ = std::numeric_limits<double>::infinity();
  double driven_m_ = 0.0;
  double next_level_m_ = 0.0;
  double next_path_s_ = -std::numeric_limits<double>::infinity();
  double cell_m_ = 1.0;
  std::map<std::pair<int, int>, double> obstacles_;  // by j, then i
  std::vector<Vec3> waypoints_;
  Curve course_, paths_, levels_, chosen_, others_;
  std::vector<routes_t> choices_;
  bool has_task_ = false;
};

template <class M>
bool read(const LogEvent& event, const char* channel, Drive* drive) {
  if (event.channel != channel) return false;
  M m;
  if (m.decode(event.data.data(), 0, static_cast<int>(event.data.size())) < 0) return true;
  if constexpr (std::is_same_v<M, command_t>) {
    drive->accept(m, event.channel == channel::kMissionCommand);
  } else {
    drive->accept(m);
  }
  return true;
}

}  // namespace

Result<std::optional<DrivingRecord>> driving_record(const std::string& log) {
  Result<LogReader> reader = LogReader::open(log);
  if (!reader) return reader.error();
  Drive drive;
  LogEvent event;
  while (reader->next(&event)) {
    (void)(read<nav_state_t>(event, channel::kWmNavState, &drive) ||
           read<integrity_t>(event, channel::kWmIntegrity, &drive) ||
           read<map_patch_t>(event, channel::kWmMapPatch, &drive) ||
           read<plan_t>(event, channel::kBgPlan, &drive) ||
           read<routes_t>(event, channel::kMissionRoutes, &drive) ||
           read<command_t>(event, channel::kMissionCommand, &drive) ||
           read<command_t>(event, channel::kBgCommand, &drive));
  }
  return std::move(drive).record();
}

}  // namespace rcs::evaluation
