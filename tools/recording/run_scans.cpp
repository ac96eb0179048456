#include "tools/recording/run_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string_view>

#include "lcmtypes/channels.h"
#include "lcmtypes/plausible.h"
#include "lcmtypes/rcs/points_t.hpp"
#include "modules/sp/scan/deskew.h"
#include "modules/sp/scan/scan.h"
#include "modules/sp/scan/scan_assembler.h"
#include "modules/sp/scan/scan_motion.h"
#include "modules/sp/sp_messages_node.h"
#include "rcs/node/log/log_file.h"
#include "tools/base/files.h"

namespace rcs::recording {
namespace {

/// Longer silences are not bridged by interpolation.
constexpr Duration kMaxGap = std::chrono::milliseconds(250);
constexpr double kFarthestPoint_m = 300.0;

class Placer {
 public:
  Placer(const RunPoses& poses, const std::function<void(const PlacedScan&)>& use)
      : poses_(poses), use_(use) {}

  /// @param scan  in: points with individual times; out: deskewed
  void place(std::int64_t id, sp::Scan* scan) {
    if (scan->points.empty()) return;
    const std::optional<Pose> T = tools::pose_at(poses_.world, scan->reference, kMaxGap);
    if (id != id_ || count_.scans + count_.no_pose == 0) {
      id_ = id;
      (T ? count_.scans : count_.no_pose) += 1;
      ++out_.number;
    }
    if (!T || !deskewed(scan)) return;
    out_.reference = scan->reference;
    out_.T_world_vehicle = *T;
    out_.twist_vehicle = twist(scan->reference);
    std::swap(out_.p_vehicle, scan->points);
    count_.points += static_cast<std::int64_t>(out_.p_vehicle.size());
    use_(out_);
  }

  ScanCount* count() { return &count_; }

 private:
  [[nodiscard]] bool deskewed(sp::Scan* scan) {
    if (scan->dt_us.empty()) return true;
    const auto [first, last] = std::minmax_element(scan->dt_us.begin(), scan->dt_us.end());
    if (*first == 0 && *last == 0) return true;
    constexpr int kKnots = 32;  // as many as SP has
    const std::optional<Pose> at_reference =
        tools::pose_at(poses_.smooth, scan->reference, kMaxGap);
    motion_.first = Duration(*first);
    motion_.step = std::max(Duration(1), Duration((*last - *first) / (kKnots - 1) + 1));
    motion_.T_reference_vehicle.clear();
    Pose latest;
    for (int k = 0; k < kKnots; ++k) {
      const Stamp stamp = scan->reference + motion_.first + k * motion_.step;
      const std::optional<Pose> T = tools::pose_at(poses_.smooth, stamp, kMaxGap);
      if (!at_reference || !T) {
        // The last scan of a run may end after its last pose.
        if (k < kKnots / 2) return false;
        motion_.T_reference_vehicle.push_back(latest);
        continue;
      }
      latest = at_reference->inverse() * *T;
      motion_.T_reference_vehicle.push_back(latest);
    }
    sp::deskew(motion_, scan);
    return true;
  }

  [[nodiscard]] Vec6 twist(Stamp stamp) const {
    constexpr Duration kHalf = std::chrono::milliseconds(20);
    const std::optional<Pose> before = tools::pose_at(poses_.smooth, stamp - kHalf, kMaxGap);
    const std::optional<Pose> after = tools::pose_at(poses_.smooth, stamp + kHalf, kMaxGap);
    if (!before || !after) return Vec6::Zero();
    return log_se3(before->inverse() * *after) / seconds(2 * kHalf);
  }

  const RunPoses& poses_;
  const std::function<void(const PlacedScan&)>& use_;
  ScanCount count_;
  PlacedScan out_;
  sp::MotionTable motion_;
  std::int64_t id_ = -1;
};

/// The points of SP: one message per part.
class PublishedPoints {
 public:
  explicit PublishedPoints(Placer* placer) : placer_(placer) {}

  void take(const LogEvent& event) {
    if (event.channel != channel::kSpPoints) return;
    const int size = static_cast<int>(event.data.size());
    if (message_.decode(event.data.data(), 0, size) != size || !plausible_stamp(message_.utime)) {
      ++placer_->count()->bad;
      return;
    }
    scan_.clear();
    scan_.reference = from_utime(message_.utime);
    for (std::size_t k = 0; k < message_.x_m.size(); ++k) {
      const Vec3f p(message_.x_m[k], message_.y_m[k], message_.z_m[k]);
      if (p.allFinite() && p.norm() < kFarthestPoint_m) {
        scan_.points.push_back(p);
      } else {
        ++placer_->count()->bad;
      }
    }
    placer_->place(message_.scan_id, &scan_);
  }
  void finish() {}

 private:
  Placer* placer_;
  points_t message_{};
  sp::Scan scan_;
};

/// The facets of the LADAR, assembled as in SP.
class Facets {
 public:
  Facets(Placer* placer, const sp::LadarParams& ladar)
      : placer_(placer), ladar_(ladar), assembler_(ladar) {}

  void take(const LogEvent& event) {
    if (event.channel == channel::kLadarRanges) take(event, &ranges_);
    if (event.channel == channel::kLadarPoints) take(event, &points_);
  }
  void finish() {
    if (!assembler_.in_hand()) return;
    placer_->count()->bad += assembler_.count().not_finite;
    placer_->place(assembler_.scan_id(), assembler_.scan());
    assembler_.release();
  }

 private:
  template <class Message>
  void take(const LogEvent& event, Message* m) {
    const int size = static_cast<int>(event.data.size());
    const bool sound = m->decode(event.data.data(), 0, size) == size;
    const std::optional<sp::FacetId> id = sound ? sp::identify(*m, ladar_) : std::nullopt;
    if (!id) {
      ++placer_->count()->bad;
      return;
    }
    sp::FacetVerdict verdict = assembler_.add(*id, sp::view(*m));
    if (verdict == sp::FacetVerdict::kNewScan) {
      finish();
      verdict = assembler_.add(*id, sp::view(*m));
    }
    if (verdict != sp::FacetVerdict::kAdded) ++placer_->count()->bad;
    if (assembler_.complete()) finish();
  }

  Placer* placer_;
  sp::LadarParams ladar_;
  sp::ScanAssembler assembler_;
  ladar_ranges_t ranges_{};
  ladar_points_t points_{};
};

template <class Reader>
Outcome read_all(LogReader* log, Reader* reader, const std::function<bool(double)>& progress) {
  LogEvent event;
  constexpr int kEvery = 10;  // a message may have 10,000 points
  for (std::int64_t n = 0; log->next(&event); ++n) {
    reader->take(event);
    if (n % kEvery != 0) continue;
    const auto size = static_cast<double>(std::max<std::int64_t>(1, log->size_bytes()));
    if (!progress(static_cast<double>(log->position_bytes()) / size)) return Error{"interrupted"};
  }
  reader->finish();
  return Done{};
}

/// Frame world moves slowly against frame local, and the vehicle moves smoothly in frame local: a
/// pose is averaged over neighbouring beliefs, transferred to its time along frame local.
tools::Trajectory smoothed(const std::vector<NavRecord>& nav) {
  constexpr Duration kReach = std::chrono::seconds(5);
  constexpr Duration kStep = std::chrono::milliseconds(200);
  std::vector<const NavRecord*> knots;
  tools::Trajectory out;
  for (const NavRecord& n : nav) {
    if (n.world_valid && (knots.empty() || n.stamp - knots.back()->stamp >= kStep)) {
      knots.push_back(&n);
    }
  }
  std::size_t first = 0;
  for (const NavRecord& n : nav) {
    if (!n.world_valid) continue;
    while (knots[first]->stamp < n.stamp - kReach) ++first;
    Vec6 sum = Vec6::Zero();
    double weights = 0.0;
    for (std::size_t k = first; k < knots.size() && knots[k]->stamp <= n.stamp + kReach; ++k) {
      const Pose carried =
          knots[k]->T_world_vehicle * (knots[k]->T_local_vehicle.inverse() * n.T_local_vehicle);
      const double u = seconds(knots[k]->stamp - n.stamp) / seconds(kReach);
      const double w = 1.0 - 0.9 * std::abs(u);
      sum += w * log_se3(n.T_world_vehicle.inverse() * carried);
      weights += w;
    }
    out.push_back({n.stamp, n.T_world_vehicle * exp_se3(sum / weights)});
  }
  return out;
}

/// Root mean square of column sigma_z_m; 0 without a file. The z axis of the vehicle is up except
/// for roll and pitch.
Result<double> read_sigma_up(const std::string& path) {
  constexpr std::string_view kColumns = "t_s,sigma_x_m,sigma_y_m,sigma_z_m,";
  if (!std::filesystem::exists(path)) return 0.0;
  const Result<std::string> text = tools::read_text(path);
  if (!text) return text.error();
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  if (line.compare(0, kColumns.size(), kColumns) != 0) {
    return Error{fmt::format("{}:1: not a file of sigmas: expected columns {}", path, kColumns)};
  }
  double square = 0.0;
  int n = 0;
  while (std::getline(lines, line)) {
    const std::optional<std::vector<double>> v = tools::parse_numbers(line);
    if (!v || v->size() < 4) return Error{fmt::format("{}:{}: not numbers", path, n + 2)};
    square += (*v)[3] * (*v)[3];
    ++n;
  }
  if (n == 0) return Error{path + ": no sigmas"};
  return std::sqrt(square / n);
}

}  // namespace

std::string sigma_file_of(const std::string& pose_file) {
  constexpr std::string_view kScans = ".scans";
  std::string stem = pose_file;
  if (stem.size() > kScans.size() &&
      stem.compare(stem.size() - kScans.size(), kScans.size(), kScans) == 0) {
    stem.resize(stem.size() - kScans.size());
  }
  return stem + ".sigma.csv";
}

Result<RunPoses> poses_of(const RunLog& run, PoseSource source, const std::string& file) {
  RunPoses poses;
  if (source == PoseSource::kTruth) {
    if (run.truth.empty()) return Error{run.path + ": no SIM_TRUTH"};
    poses.world = poses.smooth = run.truth;
    poses.datum = *run.truth_datum;
    return poses;
  }
  if (source == PoseSource::kFile) {
    const Result<std::string> text = tools::read_text(file);
    if (!text) return text.error();
    Result<tools::Trajectory> read = tools::parse_tum(*text, file);
    if (!read) return read.error();
    if (read->empty()) return Error{file + ": no poses"};
    if (!run.world_datum && !run.truth_datum) {
      return Error{run.path +
                   ": no WM_NAV_STATE with a datum and no SIM_TRUTH: the datum of the poses of " +
                   file + " is unknown"};
    }
    const Result<double> sigma_up_m = read_sigma_up(sigma_file_of(file));
    if (!sigma_up_m) return sigma_up_m.error();
    poses.sigma_up_m = *sigma_up_m;
    poses.world = poses.smooth = *std::move(read);
    poses.datum = run.world_datum ? *run.world_datum : *run.truth_datum;
    return poses;
  }
  if (run.nav.empty()) {
    return Error{run.path + ": no poses (WM_NAV_STATE); use a log written by `rcs replay`"};
  }
  if (!run.world_datum) {
    return Error{run.path + ": WM never had a world pose (no datum from GPS)"};
  }
  // Scans before the initialization of WM, extrapolated by the rolling map of SP.
  const tools::Trajectory world = smoothed(run.nav);
  const Stamp first = world.front().stamp;
  Pose T_smooth_world;  // at the seam
  for (const NavRecord& n : run.nav) {
    if (n.stamp == first) T_smooth_world = world.front().T * n.T_world_vehicle.inverse();
    poses.smooth.push_back({n.stamp, n.T_local_vehicle});
  }
  const Result<ScanPoses> scans = poses_at_scans(run, Frame::kWorld);
  if (scans) {
    for (const tools::StampedPose& s : scans->poses) {
      if (s.stamp < first) poses.world.push_back({s.stamp, T_smooth_world * s.T});
    }
  }
  poses.world.insert(poses.world.end(), world.begin(), world.end());
  double square = 0.0;
  double beliefs = 0.0;
  for (const NavRecord& n : run.nav) {
    if (!n.world_valid) continue;
    const Mat3 R = n.T_world_vehicle.rotation();
    square += (R * n.cov_world_pose.topLeftCorner<3, 3>() * R.transpose())(2, 2);
    beliefs += 1.0;
  }
  poses.sigma_up_m = std::sqrt(std::max(0.0, square) / beliefs);
  poses.datum = *run.world_datum;
  return poses;
}

Result<ScanCount> for_each_scan(const std::string& log, const RunPoses& poses,
                                const std::optional<sp::LadarParams>& ladar,
                                const std::function<void(const PlacedScan&)>& use,
                                const std::function<bool(double)>& progress) {
  Result<LogReader> reader = LogReader::open(log);
  if (!reader) return reader.error();
  Placer placer(poses, use);
  Outcome read = Done{};
  if (ladar) {
    Facets facets(&placer, *ladar);
    read = read_all(&*reader, &facets, progress);
  } else {
    PublishedPoints points(&placer);
    read = read_all(&*reader, &points, progress);
  }
  if (!read) return read.error();
  if (!reader->health().good()) placer.count()->damage = reader->health().summary();
  return *placer.count();
}

}  // namespace rcs::recording
