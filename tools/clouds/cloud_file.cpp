#include "tools/clouds/cloud_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

#include "tools/base/files.h"
#include "tools/base/kitti_bin.h"
#include "tools/clouds/cloud_layout.h"

namespace rcs::clouds {
namespace {

std::string_view view(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class Collector {
 public:
  void add(double x, double y, double z) {
    const std::int64_t record = records_++;
    const Vec3f p(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    const bool is_far = p.allFinite() && p.cwiseAbs().maxCoeff() > kFarthest_m;
    cloud_.far += is_far ? 1 : 0;
    cloud_.not_finite += p.allFinite() ? 0 : 1;
    if (!p.allFinite() || p.isZero() || is_far) {
      ++cloud_.no_return;
      return;
    }
    cloud_.points.push_back(p);
    cloud_.cell.push_back(static_cast<std::int32_t>(record));
  }

  Result<Cloud> finish(const CloudShape& shape, const std::string& name) {
    if (cloud_.far > 0 && cloud_.points.empty()) {
      return Error{
          fmt::format("{}: all points are more than {:.0f} km from the origin; subtract a nearby "
                      "origin from map coordinates first",
                      name, 1e-3 * kFarthest_m)};
    }
    if (shape.rows == 0) {
      cloud_.cell.clear();
      return std::move(cloud_);
    }
    if (std::int64_t{shape.rows} * shape.cols != records_) {
      return Error{fmt::format("{}: {} records are not {} x {} cells", name, records_, shape.rows,
                               shape.cols)};
    }
    cloud_.rows = shape.rows;
    cloud_.cols = shape.cols;
    return std::move(cloud_);
  }

 private:
  static constexpr float kFarthest_m = 10'000.0F;  // a float is 1 mm there
  Cloud cloud_;
  std::int64_t records_ = 0;
};

/// Lines of numbers, the coordinates in columns `at`.
Outcome collect_text(std::string_view text, const std::string& name, int line_number,
                     std::int64_t most, const std::array<std::size_t, 3>& at, Collector* out) {
  const std::vector<std::size_t> columns(at.begin(), at.end());
  const std::size_t least = *std::max_element(columns.begin(), columns.end()) + 1;
  std::vector<double> p(3);
  for (std::int64_t n = 0; n < most && !text.empty();) {
    const std::string_view line = next_line(&text);
    ++line_number;
    const Result<std::size_t> found = parse_columns(line, columns, &p);
    if (!found) return Error{fmt::format("{}:{}: {}", name, line_number, found.error().message)};
    if (*found == 0) continue;
    if (*found < least)
      return Error{fmt::format("{}:{}: fewer than three coordinates", name, line_number)};
    out->add(p[0], p[1], p[2]);
    ++n;
  }
  return Done{};
}

Result<Cloud> parse_records(const std::vector<std::uint8_t>& bytes, const std::string& name,
                            const CloudLayout& layout, const CloudShape& shape) {
  const Result<std::array<std::size_t, 3>> axes = layout.axes(name);
  if (!axes) return axes.error();
  const std::array<std::size_t, 3>& at = *axes;
  Collector out;
  if (layout.ascii) {
    const Outcome read = collect_text(view(bytes).substr(layout.data_at), name, layout.header_lines,
                                      layout.records, at, &out);
    if (!read) return read.error();
  } else {
    const std::size_t stride = layout.offset(layout.fields.size());
    const std::size_t left = (bytes.size() - layout.data_at) / stride;
    if (left < static_cast<std::size_t>(layout.records)) {
      return Error{
          fmt::format("{}: header has {} points, the file {}", name, layout.records, left)};
    }
    std::array<std::size_t, 3> offset{};
    for (std::size_t k = 0; k < 3; ++k) offset[k] = layout.offset(at[k]);
    const std::uint8_t* record = bytes.data() + layout.data_at;
    for (std::int64_t n = 0; n < layout.records; ++n, record += stride) {
      out.add(load(layout.fields[at[0]].type, record + offset[0]),
              load(layout.fields[at[1]].type, record + offset[1]),
              load(layout.fields[at[2]].type, record + offset[2]));
    }
  }
  return out.finish(shape.rows > 0 ? shape : CloudShape{layout.rows, layout.cols}, name);
}

Result<Cloud> parse_kitti_bin(const std::vector<std::uint8_t>& bytes, const std::string& name,
                              const CloudShape& shape) {
  CloudLayout layout;
  layout.fields = {
      {"x", Number::kF32}, {"y", Number::kF32}, {"z", Number::kF32}, {"intensity", Number::kF32}};
  if (Outcome sound = tools::check_kitti_bin(bytes, name); !sound) return sound.error();
  layout.records = static_cast<std::int64_t>(bytes.size() / tools::kKittiRecordBytes);
  return parse_records(bytes, name, layout, shape);
}

}  // namespace

Result<Cloud> parse_cloud(const std::vector<std::uint8_t>& bytes, const std::string& name,
                          const CloudShape& shape) {
  const std::string kind = name.substr(std::min(name.rfind('.'), name.size()));
  if (kind == ".bin") return parse_kitti_bin(bytes, name, shape);
  if (kind == ".xyz") {
    Collector out;
    const Outcome read = collect_text(view(bytes), name, 0, INT64_MAX, {0, 1, 2}, &out);
    if (!read) return read.error();
    return out.finish(shape, name);
  }
  if (kind != ".pcd" && kind != ".ply") {
    return Error{name + ": the name must end in .pcd, .ply, .bin or .xyz"};
  }
  const Result<CloudLayout> layout =
      kind == ".pcd" ? parse_pcd_header(view(bytes), name) : parse_ply_header(view(bytes), name);
  if (!layout) return layout.error();
  return parse_records(bytes, name, *layout, shape);
}

std::string skipped_text(const Cloud& cloud) {
  if (cloud.no_return == 0) return "";
  std::string text = fmt::format("{} of {} points skipped", cloud.no_return,
                                 static_cast<std::int64_t>(cloud.points.size()) + cloud.no_return);
  const char* separator = ": ";
  const auto add = [&](std::int64_t n, const char* what) {
    if (n == 0) return;
    text += fmt::format("{}{} {}", separator, n, what);
    separator = ", ";
  };
  add(cloud.not_finite, "not finite");
  add(cloud.no_return - cloud.not_finite - cloud.far, "at the origin");
  add(cloud.far, "more than 10 km from the origin");
  return text;
}

std::size_t drop_coincident(Cloud* cloud) {
  Points& p = cloud->points;
  const auto place = [&p](std::size_t i) { return std::make_tuple(p.x[i], p.y[i], p.z[i]); };
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&place](std::size_t a, std::size_t b) { return place(a) < place(b); });
  std::vector<bool> again(p.size(), false);
  for (std::size_t k = 1; k < order.size(); ++k) {
    again[order[k]] = place(order[k]) == place(order[k - 1]);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < again.size(); ++i) {
    if (again[i]) continue;
    std::tie(p.x[kept], p.y[kept], p.z[kept]) = place(i);
    if (!cloud->cell.empty()) cloud->cell[kept] = cloud->cell[i];
    ++kept;
  }
  p.resize(kept);
  if (!cloud->cell.empty()) cloud->cell.resize(kept);
  return again.size() - kept;
}

Result<Cloud> read_cloud(const std::string& path, const CloudShape& shape) {
  const Result<std::vector<std::uint8_t>> bytes = tools::read_bytes(path);
  if (!bytes) return bytes.error();
  return parse_cloud(*bytes, path, shape);
}

}  // namespace rcs::clouds
