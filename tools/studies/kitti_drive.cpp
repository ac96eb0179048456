#include "tools/studies/kitti_drive.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "modules/registration/gicp.h"
#include "tools/base/files.h"
#include "tools/base/trajectory.h"

namespace rcs::studies {
namespace {

namespace fs = std::filesystem;

constexpr int kRows = 32;
constexpr int kCols = 180;
constexpr double kLeft_rad = radians(40.0);
constexpr double kWidth_rad = radians(80.0);
constexpr double kLowest_rad = radians(-18.0);
constexpr double kHeight_rad = radians(20.0);

/// The archive of sweeps in a folder; empty: none.
std::string find_archive(const std::string& folder) {
  std::error_code failed;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename().string();
    const bool ends = name.size() > 7 && name.compare(name.size() - 7, 7, ".tar.xz") == 0;
    if (ends && name.rfind("velodyne_bin_", 0) == 0) return entry.path().string();
  }
  return {};
}

/// Runs tar without a shell.
Outcome unpack(const std::string& archive, const std::string& folder) {
  std::array<std::string, 5> args = {"tar", "-xJf", archive, "-C", folder};
  std::array<char*, 6> argv{};
  for (std::size_t i = 0; i < args.size(); ++i) argv[i] = args[i].data();
  pid_t pid = 0;
  int status = 0;
  if (::posix_spawnp(&pid, "tar", nullptr, nullptr, argv.data(), environ) != 0 ||
      ::waitpid(pid, &status, 0) != pid || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return Error{archive + ": tar failed to unpack it"};
  }
  return Done{};
}

}  // namespace

Points real_cut(const Points& sweep_ladar) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  struct Cell {
    std::size_t point = kNone;
    double distance = 0.0;  // to the middle, in cells
  };
  std::vector<Cell> cells(static_cast<std::size_t>(kRows * kCols));
  for (std::size_t i = 0; i < sweep_ladar.size(); ++i) {
    const Vec3 p = sweep_ladar[i].cast<double>();
    const double azimuth_rad = std::atan2(p.y(), p.x());
    const double elevation_rad = std::atan2(p.z(), std::hypot(p.x(), p.y()));
    const double u = (kLeft_rad - azimuth_rad) / kWidth_rad * kCols;
    const double v = (elevation_rad - kLowest_rad) / kHeight_rad * kRows;
    if (!(u >= 0.0 && u < kCols && v >= 0.0 && v < kRows)) continue;
    const double distance = std::hypot(u - std::floor(u) - 0.5, v - std::floor(v) - 0.5);
    Cell& cell = cells[static_cast<std::size_t>(v) * kCols + static_cast<std::size_t>(u)];
    if (cell.point == kNone || distance < cell.distance) cell = {i, distance};
  }
  Points out;
  for (const Cell& cell : cells) {
    if (cell.point != kNone) out.push_back(sweep_ladar[cell.point]);
  }
  return out;
}

ImageShape real_cut_shape() {
  return {kRows, kCols, kLeft_rad, kWidth_rad, kLowest_rad, kHeight_rad};
}

Points deskew(const importers::Sweep& sweep, const Pose& T_sweep_next) {
  const Vec6 period = log_se3(T_sweep_next);
  Points out;
  out.reserve(sweep.points_ladar.size());
  for (std::size_t i = 0; i < sweep.points_ladar.size(); ++i) {
    const Pose T_middle_shot = exp_se3((sweep.phase[i] - 0.5) * period);
    out.push_back((T_middle_shot * sweep.points_ladar[i].cast<double>()).cast<float>());
  }
  return out;
}

Result<std::vector<ScanPair>> parse_reference_pairs(std::string_view text, std::string_view name) {
  constexpr std::size_t kColumns = 16;
  std::vector<ScanPair> pairs;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view row = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line == 1 || row.empty()) continue;
    const std::optional<std::vector<double>> v = tools::parse_numbers(row);
    if (!v || v->size() != kColumns) {
      return Error{fmt::format("{}:{}: expected {} numbers", name, line, kColumns)};
    }
    const auto scan = [&v](std::size_t i) {
      const double n = (*v)[i];
      return n >= 0.0 && n < 1e6 && n == std::floor(n) ? static_cast<int>(n) : -1;
    };
    const auto at = [&v](int i, int j) { return (*v)[static_cast<std::size_t>(2 + 4 * i + j)]; };
    Mat3 R;
    for (int i = 0; i < 3; ++i) R.row(i) << at(i, 0), at(i, 1), at(i, 2);
    if (scan(0) < 0 || scan(1) < 0 || (R.transpose() * R - Mat3::Identity()).norm() > 1e-3 ||
        R.determinant() < 0.0) {
      return Error{
          fmt::format("{}:{}: expected the numbers of two scans and a motion", name, line)};
    }
    pairs.push_back({scan(0), scan(1), {Quat(R).normalized(), Vec3(at(0, 3), at(1, 3), at(2, 3))}});
  }
  return pairs;
}

Result<KittiDrive> KittiDrive::open(const std::string& folder) {
  const std::string path = folder + "/reference_pairs.csv";
  const Result<std::string> text = tools::read_text(path);
  if (!text) return text.error();
  Result<std::vector<ScanPair>> pairs = parse_reference_pairs(*text, path);
  if (!pairs) return pairs.error();
  Result<KittiDrive> drive = open_sweeps(folder);
  if (drive) drive->references_ = std::move(pairs).value();
  return drive;
}

Result<KittiDrive> KittiDrive::open_sweeps(const std::string& folder) {
  KittiDrive drive;
  drive.sweeps_ = folder;
  const std::string archive = find_archive(folder);
  if (archive.empty()) return drive;
  drive.temporary_ = (fs::temp_directory_path() / "rcs_kitti_XXXXXX").string();
  if (::mkdtemp(drive.temporary_.data()) == nullptr) {
    return Error{drive.temporary_ + ": cannot create a temporary folder"};
  }
  drive.sweeps_ = drive.temporary_;
  if (const Outcome unpacked = unpack(archive, drive.temporary_); !unpacked) {
    return unpacked.error();
  }
  return drive;
}

KittiDrive::KittiDrive(KittiDrive&& other) noexcept
    : references_(std::move(other.references_)),
      sweeps_(std::move(other.sweeps_)),
      temporary_(std::exchange(other.temporary_, {})) {}

KittiDrive::~KittiDrive() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

Result<importers::Sweep> KittiDrive::sweep(int number) const {
  const std::string path = fmt::format("{}/{:010d}.bin", sweeps_, number);
  const Result<std::vector<std::uint8_t>> bytes = tools::read_bytes(path);
  if (!bytes) return bytes.error();
  return importers::parse_sweep(*bytes, path);
}

Result<Points> KittiDrive::deskewed(int number, const std::vector<ScanPair>& pairs) const {
  const Pose* motion = nullptr;
  for (const ScanPair& pair : pairs) {
    if (pair.data != pair.model + 1) continue;
    if (pair.model == number || (pair.data == number && motion == nullptr)) {
      motion = &pair.T_model_data;
    }
  }
  if (motion == nullptr) {
    return Error{fmt::format("{}: sweep {} is in no pair of consecutive sweeps", sweeps_, number)};
  }
  const Result<importers::Sweep> whole = sweep(number);
  if (!whole) return whole.error();
  return deskew(*whole, *motion);
}

Result<std::vector<ScanPair>> KittiDrive::deskewed(std::vector<ScanPair> pairs) const {
  std::map<int, registration::GicpCloud> clouds;
  for (const ScanPair& pair : pairs) {
    for (const int number : {pair.model, pair.data}) {
      if (clouds.count(number) != 0) continue;
      const Result<Points> points = deskewed(number, pairs);
      if (!points) return points.error();
      clouds.try_emplace(number, *points, registration::GicpParams{});
    }
  }
  for (ScanPair& pair : pairs) {
    const registration::Registration r = registration::register_gicp(
        clouds.at(pair.model), clouds.at(pair.data), pair.T_model_data, {});
    if (!registration::usable(r.stop)) {
      return Error{
          fmt::format("{}: sweeps {} and {} cannot be registered", sweeps_, pair.model, pair.data)};
    }
    pair.T_model_data = r.T_target_vehicle;
  }
  return pairs;
}

Result<ScanSet> KittiDrive::real_cuts(const std::vector<ScanPair>& pairs) const {
  ScanSet set;
  set.pairs = pairs;
  for (const ScanPair& pair : pairs) {
    for (const int number : {pair.model, pair.data}) {
      if (set.scans.count(number) != 0) continue;
      const Result<importers::Sweep> whole = sweep(number);
      if (!whole) return whole.error();
      set.scans.emplace(number, real_cut(whole->points_ladar));
    }
  }
  return set;
}

}  // namespace rcs::studies
