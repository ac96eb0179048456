#include "tools/base/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace rcs::tools {
namespace {

constexpr double kRotationTolerance = 1e-3;

/// Calls `row(numbers, line number)` for each line that is neither empty nor a comment.
template <class Row>
Outcome for_each_row(std::string_view text, std::string_view name, std::size_t columns, Row row) {
  int line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    const std::optional<std::vector<double>> values = parse_numbers(line);
    if (!values || values->size() != columns) {
      return Error{fmt::format("{}:{}: expected {} finite numbers, found {}", name, line_number,
                               columns,
                               values ? std::to_string(values->size()) : "something else")};
    }
    if (Outcome outcome = row(*values, line_number); !outcome) return outcome;
  }
  return Done{};
}

}  // namespace

std::optional<std::vector<double>> parse_numbers(std::string_view line) {
  std::vector<double> out;
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\r' || *at == ',')) ++at;
    if (at == end) return out;
    if (*at == '+') ++at;
    double value = 0.0;
    const std::from_chars_result r = std::from_chars(at, end, value);
    if (r.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
    out.push_back(value);
    at = r.ptr;
  }
}

std::optional<Pose> pose_at(const Trajectory& trajectory, Stamp stamp, Duration max_gap) {
  const Trajectory::const_iterator after =
      std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                       [](const StampedPose& s, Stamp t) { return s.stamp < t; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp == stamp) return after->T;
  if (after == trajectory.begin()) return std::nullopt;
  const StampedPose& before = *(after - 1);
  if (after->stamp - before.stamp > max_gap) return std::nullopt;
  return interpolate(before.T, after->T,
                     seconds(stamp - before.stamp) / seconds(after->stamp - before.stamp));
}

Result<std::vector<Pose>> parse_kitti(std::string_view text, std::string_view name) {
  std::vector<Pose> poses;
  const Outcome outcome =
      for_each_row(text, name, 12, [&](const std::vector<double>& v, int line) -> Outcome {
        Mat3 R;
        R << v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10];
        const Mat3 defect = R.transpose() * R - Mat3::Identity();
        if (defect.norm() > kRotationTolerance || R.determinant() < 0.0) {
          return Error{fmt::format("{}:{}: the 3x3 part is not a rotation", name, line)};
        }
        poses.push_back({Quat(R).normalized(), Vec3(v[3], v[7], v[11])});
        return Done{};
      });
  if (!outcome) return outcome.error();
  return poses;
}

Result<Trajectory> parse_tum(std::string_view text, std::string_view name) {
  Trajectory trajectory;
  const Outcome outcome =
      for_each_row(text, name, 8, [&](const std::vector<double>& v, int line) -> Outcome {
        const Quat q(v[7], v[4], v[5], v[6]);
        if (std::abs(q.norm() - 1.0) > kRotationTolerance) {
          return Error{
              fmt::format("{}:{}: the quaternion's norm is {:.6f}, not 1", name, line, q.norm())};
        }
        const std::optional<Duration> since_epoch = checked_seconds(v[0]);
        if (!since_epoch) {
          return Error{fmt::format("{}:{}: {} s is not a time: the limit is {:.1e} s", name, line,
                                   v[0], seconds(kMaxDuration))};
        }
        const Stamp stamp(*since_epoch);
        if (!trajectory.empty() && stamp <= trajectory.back().stamp) {
          return Error{fmt::format("{}:{}: the stamps do not ascend", name, line)};
        }
        trajectory.push_back({stamp, {q.normalized(), Vec3(v[1], v[2], v[3])}});
        return Done{};
      });
  if (!outcome) return outcome.error();
  return trajectory;
}

std::string format_kitti(const Trajectory& trajectory) {
  std::string out;
  for (const StampedPose& s : trajectory) {
    const Eigen::Matrix4d m = s.T.matrix();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 4; ++j) {
        fmt::format_to(std::back_inserter(out), "{:.9e}{}", m(i, j), i == 2 && j == 3 ? '\n' : ' ');
      }
    }
  }
  return out;
}

std::string format_tum(const Trajectory& trajectory) {
  std::string out;
  for (const StampedPose& s : trajectory) {
    const std::int64_t t = to_utime(s.stamp);
    // Integers, not a double: an epoch of 2e9 s would lose the microseconds.
    fmt::format_to(std::back_inserter(out),
                   "{}{}.{:06d} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n",
                   t < 0 ? "-" : "", std::abs(t) / 1'000'000, std::abs(t) % 1'000'000, s.T.p.x(),
                   s.T.p.y(), s.T.p.z(), s.T.q.x(), s.T.q.y(), s.T.q.z(), s.T.q.w());
  }
  return out;
}

std::vector<double> distances(const std::vector<Pose>& poses) {
  std::vector<double> out(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    out[i] = out[i - 1] + (poses[i].p - poses[i - 1].p).norm();
  }
  return out;
}

}  // namespace rcs::tools
