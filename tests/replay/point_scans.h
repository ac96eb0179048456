#pragma once
// Scans in memory as LADAR_POINTS in lockstep.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "rcs/base/check.h"
#include "rcs/base/points.h"
#include "rcs/node/params/params.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs::test {

/// Each scan in facets of consecutive points, 6 ms apart from its reference instant on.
class PointScans final : public EventSource {
 public:
  /// @param scans  frame of the LADAR [m]
  /// @param lasts  a scan is measured in this time before its reference instant; 0: at it
  PointScans(std::vector<Points> scans, Duration interval, int facets, Duration lasts = {})
      : scans_(std::move(scans)), interval_(interval), facets_(facets), lasts_(lasts) {}

  Stamp peek() override {
    if (scan_ == scans_.size()) return Stamp::max();
    return reference() + (facet_ + 1) * from_milliseconds(6.0);
  }

  void take(SourceEvent* event) override {
    const Points& points = scans_[scan_];
    const auto bound = [&](int facet) {
      return static_cast<std::ptrdiff_t>(points.size()) * facet / facets_;
    };
    const auto part = [&](const std::vector<float>& all) {
      return std::vector<float>(all.begin() + bound(facet_), all.begin() + bound(facet_ + 1));
    };
    ladar_points_t m{};
    m.utime = to_utime(reference() - lasts_);
    m.reference_utime = to_utime(reference());
    m.seq = ++seq_;
    m.scan_id = static_cast<std::int64_t>(scan_);
    m.facet = static_cast<std::int16_t>(facet_);
    m.facet_count = static_cast<std::int16_t>(facets_);
    m.x_m = part(points.x);
    m.y_m = part(points.y);
    m.z_m = part(points.z);
    m.n = static_cast<std::int32_t>(m.x_m.size());
    for (std::ptrdiff_t i = bound(facet_); lasts_ > Duration::zero() && i < bound(facet_ + 1);
         ++i) {
      m.dt_us.push_back(static_cast<std::int32_t>(lasts_.count() * i /
                                                  std::max<std::ptrdiff_t>(1, bound(facets_) - 1)));
    }
    m.n_time = static_cast<std::int32_t>(m.dt_us.size());
    event->channel = channel::kLadarPoints;
    event->data.resize(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(event->data.data(), 0, m.getEncodedSize());
    if (++facet_ < facets_) return;
    facet_ = 0;
    ++scan_;
  }

 private:
  [[nodiscard]] Stamp reference() const { return Stamp() + static_cast<int>(scan_) * interval_; }

  std::vector<Points> scans_;
  Duration interval_;
  int facets_;
  Duration lasts_;
  std::size_t scan_ = 0;
  int facet_ = 0;
  std::int64_t seq_ = 0;
};

/// @param toml  configuration; must be valid
inline ParamFile parsed(const std::string& toml) {
  Result<ParamFile> file = ParamFile::parse(toml, "test");
  RCS_CHECK(file.ok());
  return std::move(file).value();
}

}  // namespace rcs::test
