#pragma once
// Sweeps of a KITTI drive as pairs of scans of the size in the paper.

#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "tools/importers/kitti_sweep.h"
#include "tools/studies/figures/scan_picture.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::studies {

/// Folder of the drive below the folder of all real data (RCS_DATA_DIR).
constexpr std::string_view kKittiDrive = "kitti_2011_09_26_drive_0005";

/// A range image as in the paper, cut from a sweep of 64 beams: 32 x 180 cells over 80 deg ahead
/// and -18 to +2 deg of elevation, each with the return nearest to its centre.
[[nodiscard]] Points real_cut(const Points& sweep_ladar);
/// The cells of these range images.
[[nodiscard]] ImageShape real_cut_shape();

/// The points of the sweep, deskewed to the time of its middle.
/// @param T_sweep_next  motion to the middle of the next sweep, assumed uniform
[[nodiscard]] Points deskew(const importers::Sweep& sweep, const Pose& T_sweep_next);

/// Rows "model,data,T00,...,T23,spread_m,spread_deg" under a header: T_model_data, and the
/// differences between several methods.
[[nodiscard]] Result<std::vector<ScanPair>> parse_reference_pairs(std::string_view text,
                                                                  std::string_view name);

/// Folder of a drive: reference_pairs.csv, and sweeps %010d.bin or an archive of them,
/// velodyne_bin_*.tar.xz, which is unpacked into a temporary folder for the lifetime of this
/// object.
class KittiDrive {
 public:
  [[nodiscard]] static Result<KittiDrive> open(const std::string& folder);
  /// A folder without reference_pairs.csv: references() is empty.
  [[nodiscard]] static Result<KittiDrive> open_sweeps(const std::string& folder);
  KittiDrive(KittiDrive&& other) noexcept;
  KittiDrive& operator=(KittiDrive&&) = delete;
  ~KittiDrive();

  [[nodiscard]] const std::vector<ScanPair>& references() const { return references_; }
  [[nodiscard]] Result<importers::Sweep> sweep(int number) const;
  /// The points of a sweep, deskewed with the motion to the next sweep, or from the one before if
  /// no pair has that one.
  /// @param pairs  a consecutive one contains the sweep
  [[nodiscard]] Result<Points> deskewed(int number, const std::vector<ScanPair>& pairs) const;
  /// `pairs` with the motions of the whole sweeps, deskewed, by generalized ICP: another method
  /// than the one that is judged by them. references() assumes rigid sweeps (ADR 120).
  /// @param pairs  the guesses; each sweep is in a pair of consecutive sweeps
  [[nodiscard]] Result<std::vector<ScanPair>> deskewed(std::vector<ScanPair> pairs) const;
  /// Cuts of all sweeps of the pairs.
  [[nodiscard]] Result<ScanSet> real_cuts(const std::vector<ScanPair>& pairs) const;

 private:
  KittiDrive() = default;

  std::vector<ScanPair> references_;
  std::string sweeps_;
  std::string temporary_;
};

}  // namespace rcs::studies
