#include "tools/survey/cloud_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "tools/clouds/survey_points.h"
#include "tools/mapping/map_writer.h"
#include "tools/survey/survey_crs.h"
#include "tools/survey/survey_frame.h"

namespace rcs::survey {
namespace {

constexpr int kLowNoise = 7;
constexpr int kHighNoise = 18;

/// The files of one survey as one.
class CloudSurvey {
 public:
  CloudSurvey(const CloudImport& wanted, const std::function<bool(double)>& progress)
      : wanted_(wanted), progress_(progress) {}

  Outcome open() {
    for (const std::string& path : wanted_.paths) {
      Result<std::unique_ptr<clouds::SurveyPointFile>> file =
          clouds::open_survey_points(path, wanted_.class_column);
      if (!file) return file.error();
      files_.push_back(std::move(file).value());
      if (Outcome read = read_crs(path); !read) return read;
    }
    return Done{};
  }
  [[nodiscard]] const OGRSpatialReference* crs() const { return crs_ ? &*crs_ : nullptr; }
  void expect_points(std::int64_t points) { points_ = points; }
  /// Range of the progress during the next reading.
  void expect(double from, double to) {
    from_ = from;
    to_ = to;
  }

  /// Reads all points once, block by block. @param take  receives them and may modify them
  template <class F>
  Outcome read(const F& take) {
    clouds::SurveyPoints block;
    std::int64_t seen = 0;
    for (std::size_t k = 0; k < files_.size(); ++k) {
      Outcome done = files_[k]->rewind();
      for (;;) {
        if (done) done = files_[k]->next(&block);
        if (!done) return done;
        if (block.size() == 0) break;
        seen += static_cast<std::int64_t>(block.size());
        if (Outcome taken = take(&block); !taken) return taken;
        // In the first reading the number of points is unknown: progress by files.
        const double share = points_ > 0
                                 ? static_cast<double>(seen) / static_cast<double>(points_)
                                 : static_cast<double>(k) / static_cast<double>(files_.size());
        if (!progress_(from_ + (to_ - from_) * std::min(1.0, share))) return Error{"interrupted"};
      }
    }
    return Done{};
  }

 private:
  Outcome read_crs(const std::string& path) {
    if (!wanted_.crs.empty()) return Done{};  // overrides the files
    Result<std::optional<OGRSpatialReference>> own = survey_crs(files_.back()->crs());
    if (!own) return Error{path + ": " + own.error().message};
    if (files_.size() == 1) {
      crs_ = std::move(own).value();
      return Done{};
    }
    const bool same =
        own->has_value() == crs_.has_value() && (!crs_ || (*own)->IsSame(&*crs_) != 0);
    if (same) return Done{};
    return Error{path + ": its coordinate reference system differs from that of " +
                 wanted_.paths.front() + ": give one for all files by --crs"};
  }

  const CloudImport& wanted_;
  const std::function<bool(double)>& progress_;
  std::vector<std::unique_ptr<clouds::SurveyPointFile>> files_;
  std::optional<OGRSpatialReference> crs_;
  std::int64_t points_ = 0;
  double from_ = 0.0;
  double to_ = 0.0;
};

class Importer {
 public:
  Importer(const CloudImport& wanted, const std::function<bool(double)>& progress)
      : wanted_(wanted), survey_(wanted, progress) {
    for (const int c : wanted.ground_classes) ground_class_[static_cast<std::size_t>(c)] = true;
  }

  Result<CloudImported> import(const std::string& map) {
    Outcome done = survey_.open();
    if (done) done = look();
    if (done) done = find_frame();
    if (done) done = find_density();
    if (!done) return done.error();
    const MapLevel level{out_.cell_m, Vec2::Zero(), wanted_.quality.bias_sigma_m,
                         wanted_.quality.bias_correlation_m};
    // Check before the long work that the output may be written.
    Result<mapping::MapWriter> writer = mapping::MapWriter::create(map, frame_->map(), {level});
    if (!writer) return writer.error();
    done = find_surface();
    if (done) done = measure(level);
    if (done) done = write(&*writer);
    if (!done) return done.error();
    return out_;
  }

 private:
  [[nodiscard]] static bool is_noise(std::int16_t klass) {
    return klass == kLowNoise || klass == kHighNoise;
  }
  [[nodiscard]] const std::string& name() const { return wanted_.paths.front(); }

  /// Counts all points, and finds their extent.
  Outcome look() {
    survey_.expect(0.0, 0.15);
    Vec2 low = Vec2::Constant(std::numeric_limits<double>::infinity());
    Vec2 high = -low;
    Outcome read = survey_.read([&](const clouds::SurveyPoints* block) -> Outcome {
      for (std::size_t k = 0; k < block->size(); ++k) {
        ++out_.points;
        const std::int16_t klass = block->klass[k];
        if (block->invalid[k] != 0) {
          ++out_.invalid;
        } else if (is_noise(klass)) {
          ++out_.noise;
        } else {
          if (klass != clouds::kNoClass) ++out_.by_class[static_cast<std::size_t>(klass)];
          const Vec2 p(block->x[k], block->y[k]);
          low = low.cwiseMin(p);
          high = high.cwiseMax(p);
        }
      }
      return Done{};
    });
    if (!read) return read;
    if (!(low.x() <= high.x())) {
      return Error{
          fmt::format("{}: no valid point of {}: {} flagged as withheld or not finite, {} noise",
                      name(), out_.points, out_.invalid, out_.noise)};
    }
    survey_.expect_points(out_.points);
    low_ = low;
    high_ = high;
    if (wanted_.ignore_classes) return Done{};
    for (std::size_t c = 0; c < ground_class_.size(); ++c) {
      out_.by_classes = out_.by_classes || (ground_class_[c] && out_.by_class[c] > 0);
    }
    return Done{};
  }

  Outcome find_frame() {
    Result<SurveyFrame> frame = SurveyFrame::find(wanted_, survey_.crs(), low_, high_);
    if (!frame) return Error{name() + ": " + frame.error().message};
    frame_.emplace(std::move(frame).value());
    out_.frame = frame_->map();
    return Done{};
  }

  /// Candidate ground points in the frame of the map: by class, or last returns.
  template <class F>
  Outcome read_candidates(const F& take) {
    return survey_.read([&](clouds::SurveyPoints* block) -> Outcome {
      std::size_t n = 0;
      for (std::size_t k = 0; k < block->size(); ++k) {
        const std::int16_t klass = block->klass[k];
        if (block->invalid[k] != 0 || is_noise(klass)) continue;
        const bool fits = out_.by_classes ? klass != clouds::kNoClass &&
                                                ground_class_[static_cast<std::size_t>(klass)]
                                          : block->last[k] != 0;
        if (!fits) continue;
        block->x[n] = block->x[k];
        block->y[n] = block->y[k];
        block->z[n] = block->z[k];
        ++n;
      }
      block->x.resize(n);
      block->y.resize(n);
      block->z.resize(n);
      if (Outcome sound = check_heights(block->z); !sound) return sound;
      frame_->to_map(&block->x, &block->y, &block->z);
      for (std::size_t k = 0; k < n; ++k) {
        const Vec3 p(block->x[k], block->y[k], block->z[k]);
        if (Outcome taken = take(p); !taken) return taken;
      }
      return Done{};
    });
  }

  [[nodiscard]] Outcome check_heights(const std::vector<double>& z) const {
    constexpr double kLowest_m = -1000.0;
    constexpr double kHighest_m = 10000.0;
    for (const double v : z) {
      const double h = v * frame_->unit_m();
      if (h >= kLowest_m && h <= kHighest_m) continue;
      return Error{fmt::format(
          "{}: {} is a height of {} m, outside {} to {} m; if the unit differs, use --height-unit; "
          "if it is an outlier, classify it as noise (7)",
          name(), v, h, kLowest_m, kHighest_m)};
    }
    return Done{};
  }

  /// The density of the candidates, and by it the cell unless one is given.
  Outcome find_density() {
    survey_.expect(0.15, 0.3);
    PointDensity density(frame_->low(), frame_->high(), out_.points);
    Outcome read = read_candidates([&](const Vec3& p) -> Outcome {
      if (p.allFinite()) density.add(p);
      return Done{};
    });
    if (!read) return read;
    out_.density = density.metrics();
    if (out_.density.points == 0) return Error{name() + ": no ground points"};
    out_.cell_m =
        wanted_.cell_m > 0.0 ? wanted_.cell_m : cell_of_density(out_.density.points_per_m2);
    return Done{};
  }

  [[nodiscard]] Error too_much(const char* what) const {
    return Error{
        fmt::format("{}: {} requires more than {:.0f} MB: choose a larger --cell, allow more "
                    "--memory, or import parts and `rcs map merge` them",
                    name(), what, 1e-6 * wanted_.memory_bytes)};
  }

  /// The coarse surface of the ground, as the reference of finer heights.
  Outcome find_surface() {
    constexpr double kFinest_m = 1.0;  // for the constants of the filter
    surface_.level.cell_m = std::max(kFinest_m, out_.cell_m);
    const Cell low = surface_.level.cell_at(frame_->low().x(), frame_->low().y());
    const Cell high = surface_.level.cell_at(frame_->high().x(), frame_->high().y());
    constexpr int kMargin = 2;  // curved borders extend beyond their corners
    const std::int64_t width = std::int64_t{high.i} - low.i + 1 + 2 * kMargin;
    const std::int64_t height = std::int64_t{high.j} - low.j + 1 + 2 * kMargin;
    const double cells = static_cast<double>(width) * static_cast<double>(height);
    // A few distant points would require the memory and time of a whole survey.
    constexpr double kCellsAnyway = 1e6;
    constexpr double kMaxCellsPerPoint = 1e4;
    const std::int64_t points = out_.points - out_.invalid - out_.noise;
    if (cells > std::max(kCellsAnyway, kMaxCellsPerPoint * static_cast<double>(points))) {
      return Error{
          fmt::format("{}: {} points in {:.3g} x {:.3g} km: fewer than one in {:.0f} cells of {} "
                      "m; if there "
                      "are outliers, classify them as noise (7)",
                      name(), points, 1e-3 * surface_.level.cell_m * static_cast<double>(width),
                      1e-3 * surface_.level.cell_m * static_cast<double>(height), kMaxCellsPerPoint,
                      surface_.level.cell_m)};
    }
    constexpr double kArrays = 8.0 * sizeof(float);  // working memory of the filter per cell
    if (kArrays * cells > wanted_.memory_bytes) return too_much("its extent");
    surface_.first = {low.i - kMargin, low.j - kMargin};
    surface_.width = static_cast<int>(width);
    surface_.height = static_cast<int>(height);
    surface_.z_m.assign(surface_.cells(), std::numeric_limits<float>::quiet_NaN());
    survey_.expect(0.3, 0.6);
    bool one = false;
    Outcome read = read_candidates([&](const Vec3& p) -> Outcome {
      if (p.allFinite()) mapping::lower(&surface_, p);
      one = one || p.allFinite();
      return Done{};
    });
    if (!read) return read;
    if (!one) return Error{name() + ": no ground points"};
    if (!out_.by_classes) surface_ = mapping::bare_earth(surface_, wanted_.bare_earth);
    surface_ = mapping::smoothed(mapping::bridged(surface_));
    return Done{};
  }

  Outcome measure(const MapLevel& level) {
    ground_ = std::make_unique<mapping::SurveyGround>(level, &surface_,
                                                      out_.by_classes
                                                          ? mapping::SurveyGround::Above::kNoise
                                                          : mapping::SurveyGround::Above::kPlants);
    survey_.expect(0.6, 0.9);
    Outcome read = read_candidates([&](const Vec3& p) -> Outcome {
      if (!p.allFinite()) {
        ++out_.unplaced;
        return Done{};
      }
      if (!out_.by_classes) {
        const mapping::SurfaceHere here = mapping::surface_at(surface_, p.x(), p.y());
        if (std::abs(p.z() - here.z_m) > ground_reach(wanted_.bare_earth, here)) return Done{};
      }
      ground_->add(p);
      if (static_cast<double>(ground_->bytes()) > wanted_.memory_bytes) return too_much("its area");
      return Done{};
    });
    if (!read) return read;
    ground_->finish(wanted_.quality.sigma_m);
    out_.ground = ground_->metrics();
    out_.not_ground = out_.points - out_.invalid - out_.noise - out_.unplaced - out_.ground.points;
    if (out_.ground.cells == 0) return Error{name() + ": no known heights"};
    return Done{};
  }

  Outcome write(mapping::MapWriter* writer) {
    for (const Cell number : ground_->tiles()) {
      Raster tile = ground_->tile(number);
      tile.date = {static_cast<std::uint16_t>(wanted_.quality.date)};
      tile.source = {wanted_.source};
      if (Outcome put = writer->put(0, tile); !put) return put;
    }
    Outcome done = writer->add_coarser_levels();
    if (done) done = writer->finish();
    return done;
  }

  const CloudImport& wanted_;
  CloudSurvey survey_;
  std::array<bool, 256> ground_class_{};
  Vec2 low_, high_;  // of the points, in the coordinates of the files
  std::optional<SurveyFrame> frame_;
  Raster surface_;
  std::unique_ptr<mapping::SurveyGround> ground_;
  CloudImported out_;
};

}  // namespace

Result<CloudImported> import_cloud(const CloudImport& wanted, const std::string& map,
                                   const std::function<bool(double)>& progress) {
  const QuietGdal quiet;
  register_formats();
  return Importer(wanted, progress).import(map);
}

}  // namespace rcs::survey
