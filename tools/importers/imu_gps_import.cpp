#include "tools/importers/imu_gps_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcmtypes/convert.h"
#include "rcs/base/geodesy.h"

namespace rcs::importers {
namespace {

using Column = std::vector<double>;
using Stamps = std::vector<std::optional<Stamp>>;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Finds tables by the ends of their names, and records which are not used.
class Tables {
 public:
  explicit Tables(const std::vector<tools::CsvTable>& tables)
      : tables_(tables), used_(tables.size()) {}

  [[nodiscard]] Result<const tools::CsvTable*> find(const std::string& file) {
    std::optional<std::size_t> found;
    for (std::size_t i = 0; i < tables_.size(); ++i) {
      if (!ends_with(tables_[i].name(), file)) continue;
      if (found) {
        return file.empty() ? Error{"several files: the column file must assign them (key file)"}
                            : Error{fmt::format("two files end in '{}'", file)};
      }
      found = i;
    }
    if (!found)
      return Error{fmt::format("the column file requires a file whose name ends in '{}'", file)};
    used_[*found] = true;
    return &tables_[*found];
  }

  [[nodiscard]] Outcome all_used() const {
    for (std::size_t i = 0; i < tables_.size(); ++i) {
      if (!used_[i]) return Error{tables_[i].name() + ": the column file does not use this file"};
    }
    return Done{};
  }

 private:
  const std::vector<tools::CsvTable>& tables_;
  std::vector<bool> used_;
};

/// Columns of one table, read on demand; keeps the first error.
class Columns {
 public:
  explicit Columns(const tools::CsvTable* table) : table_(table) {}

  [[nodiscard]] Column numbers(const std::string& name, double absent = kUnknown) {
    if (name.empty()) return Column(table_->rows(), absent);
    Result<Column> column = table_->numbers(name);
    if (column) return std::move(column).value();
    if (!error_) error_ = column.error();
    return Column(table_->rows(), kUnknown);
  }
  [[nodiscard]] std::vector<Column> numbers(const std::vector<std::string>& names) {
    std::vector<Column> columns;
    columns.reserve(names.size());
    for (const std::string& name : names) columns.push_back(numbers(name));
    return columns;
  }
  [[nodiscard]] std::array<Column, 3> axes(const std::array<SignedColumn, 3>& axes, double unit) {
    std::array<Column, 3> columns;
    for (std::size_t i = 0; i < 3; ++i) {
      columns[i] = numbers(axes[i].name);
      for (double& v : columns[i]) v *= axes[i].sign * unit;
    }
    return columns;
  }
  [[nodiscard]] Stamps stamps(const StampColumn& column) {
    Result<Stamps> stamps = stamps_of(*table_, column);
    if (stamps) return std::move(stamps).value();
    if (!error_) error_ = stamps.error();
    return Stamps(table_->rows());
  }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  const tools::CsvTable* table_;
  std::optional<Error> error_;
};

Vec3 at(const std::array<Column, 3>& columns, std::size_t row) {
  return {columns[0][row], columns[1][row], columns[2][row]};
}

/// Time of arrival of the rows of a sensor; it does not run backward.
class Arrival {
 public:
  /// @return true if the stamp is after all previous ones
  bool take(Stamp stamp) {
    const bool forward = !newest_ || stamp > *newest_;
    if (forward) newest_ = stamp;
    return forward;
  }
  [[nodiscard]] Stamp now() const { return *newest_; }

 private:
  std::optional<Stamp> newest_;
};

Outcome add_imu(const ImuMap& map, Tables* tables, recording::SensorLog* log, RowCounts* counts) {
  const Result<const tools::CsvTable*> force_table = tables->find(map.stream.file);
  if (!force_table) return force_table.error();
  const bool two_files = !map.rate_file.empty();
  const Result<const tools::CsvTable*> rate_table =
      two_files ? tables->find(map.rate_file) : force_table;
  if (!rate_table) return rate_table.error();
  Columns columns(*force_table);
  Columns rate_columns(*rate_table);
  const Stamps stamps = columns.stamps(map.stream.stamp);
  const Stamps rate_stamps = rate_columns.stamps(map.stream.stamp);
  const std::array<Column, 3> forces = columns.axes(map.force, map.force_unit);
  const std::array<Column, 3> rates = rate_columns.axes(map.rate, map.rate_unit);
  for (const Columns* c : {&columns, &rate_columns}) {
    if (c->error()) return *c->error();
  }
  InsIntegrator integrator(map.max_gap);
  Arrival arrival;
  std::size_t j = 0;  // row of the rates
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    ++counts->rows;
    if (!stamps[i]) {
      ++counts->missing;
      continue;
    }
    if (two_files) {
      while (j < rate_stamps.size() && (!rate_stamps[j] || *rate_stamps[j] < *stamps[i])) ++j;
      if (j == rate_stamps.size() || *rate_stamps[j] != *stamps[i]) {
        ++counts->unpaired;
        continue;
      }
    } else {
      j = i;
    }
    const Vec3 force = map.q_vehicle_imu * at(forces, i);
    const Vec3 rate = map.q_vehicle_imu * at(rates, j);
    if (!force.allFinite() || !rate.allFinite()) {
      ++counts->missing;
      continue;
    }
    if (!arrival.take(*stamps[i])) ++counts->backward;
    ins_t m{};
    const InsIntegrator::Step step =
        integrator.add(*stamps[i] - map.stream.latency, rate, force, &m);
    if (step == InsIntegrator::Step::kGap) ++counts->gaps;
    if (step == InsIntegrator::Step::kGap || step == InsIntegrator::Step::kFirst) continue;
    log->add(arrival.now(), m);
    ++counts->written;
  }
  return Done{};
}

/// A row of a receiver, in SI units.
struct FixRow {
  double lat_deg, lon_deg, height_m;
  Vec3 sigma_m;
  double speed_mps, course_rad;
  double satellites, hdop, vdop;
};

gps_fix_t to_fix(const FixRow& row, const GpsMap& map, Stamp stamp) {
  gps_fix_t m{};
  m.utime = to_utime(stamp);
  m.lat_deg = row.lat_deg;
  m.lon_deg = row.lon_deg;
  m.height_m = row.height_m;
  m.height_kind = map.ellipsoidal ? gps_fix_t::HEIGHT_ELLIPSOIDAL : gps_fix_t::HEIGHT_ORTHOMETRIC;
  m.undulation_m = map.ellipsoidal ? kUnknown : map.undulation_m;
  to_message(row.sigma_m, m.sigma_enu_m);
  m.fix_type = gps_fix_t::FIX_SINGLE;
  m.satellites = row.satellites >= 0.0 && row.satellites < 100.0
                     ? static_cast<std::int16_t>(row.satellites)
                     : 0;
  m.hdop = row.hdop;
  m.vdop = row.vdop;
  if (!std::isfinite(row.speed_mps) || !std::isfinite(row.course_rad)) return m;
  m.has_velocity = 1;
  const double s = map.sigma_speed_mps;
  to_message(
      Vec3(row.speed_mps * std::sin(row.course_rad), row.speed_mps * std::cos(row.course_rad), 0.0),
      m.v_enu_mps);
  to_message(Vec3(s, s, std::hypot(s, map.climb * row.speed_mps)), m.sigma_v_enu_mps);
  return m;
}

bool same(const std::vector<Column>& columns, std::size_t a, std::size_t b) {
  return std::all_of(columns.begin(), columns.end(), [&](const Column& c) { return c[a] == c[b]; });
}

bool any_zero(const std::vector<Column>& columns, std::size_t row) {
  return std::any_of(columns.begin(), columns.end(),
                     [row](const Column& c) { return c[row] == 0.0; });
}

Outcome add_gps(const GpsMap& map, Tables* tables, recording::SensorLog* log, RowCounts* counts) {
  const Result<const tools::CsvTable*> table = tables->find(map.stream.file);
  if (!table) return table.error();
  Columns columns(*table);
  const Stamps stamps = columns.stamps(map.stream.stamp);
  const Stamps receiver = map.receiver ? columns.stamps(*map.receiver) : stamps;
  const Column lat = columns.numbers(map.lat), lon = columns.numbers(map.lon);
  const Column height = columns.numbers(map.height);
  const Column speed = columns.numbers(map.speed), course = columns.numbers(map.course);
  const Column fix = columns.numbers(map.fix, map.fix_min);
  const Column satellites = columns.numbers(map.satellites);
  const Column hdop = columns.numbers(map.hdop), vdop = columns.numbers(map.vdop);
  const std::vector<Column> sigmas = columns.numbers(map.sigma_columns);
  const std::vector<Column> changed_by = columns.numbers(map.changed_by);
  const std::vector<Column> not_zero = columns.numbers(map.zero_is_missing);
  if (columns.error()) return *columns.error();

  const auto sigma_at = [&](std::size_t i) {
    if (sigmas.empty()) return map.sigma_m;
    const Vec3 v(sigmas[0][i], sigmas[1][i], sigmas[2][i]);
    return Vec3(map.sigma_scale.cwiseProduct(map.variances ? Vec3(v.cwiseSqrt()) : v));
  };
  ReceiverClock clock;
  Arrival arrival;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    ++counts->rows;
    if (i > 0 && !changed_by.empty() && same(changed_by, i, i - 1)) {
      ++counts->unchanged;
      continue;
    }
    const FixRow row = {lat[i],
                        lon[i],
                        height[i],
                        sigma_at(i),
                        speed[i] * map.speed_unit,
                        radians(course[i]),
                        satellites[i],
                        hdop[i],
                        vdop[i]};
    const Vec3 place(row.lat_deg, row.lon_deg, row.height_m);
    if (!stamps[i] || !receiver[i] || !place.allFinite() || !std::isfinite(fix[i]) ||
        !row.sigma_m.allFinite() || any_zero(not_zero, i)) {
      ++counts->missing;
      continue;
    }
    if (fix[i] < map.fix_min) {
      ++counts->no_fix;
      continue;
    }
    const EllipsoidalHeight h{row.height_m + (map.ellipsoidal ? 0.0 : map.undulation_m)};
    if (!plausible(Geodetic{radians(row.lat_deg), radians(row.lon_deg), h}) ||
        row.sigma_m.minCoeff() <= 0.0) {
      ++counts->implausible;
      continue;
    }
    if (!arrival.take(*stamps[i])) ++counts->backward;
    const Stamp valid =
        map.receiver ? clock.device_time(*stamps[i], receiver[i]->time_since_epoch()) : *stamps[i];
    const gps_fix_t m = to_fix(row, map, valid - map.stream.latency);
    if (!map.speed.empty() && m.has_velocity == 0) ++counts->without_velocity;
    log->add(arrival.now(), m);
    ++counts->written;
  }
  counts->clock_steps = clock.steps();
  return Done{};
}

Outcome add_wheels(const WheelMap& map, Tables* tables, recording::SensorLog* log,
                   RowCounts* counts) {
  const Result<const tools::CsvTable*> table = tables->find(map.stream.file);
  if (!table) return table.error();
  Columns columns(*table);
  const Stamps stamps = columns.stamps(map.stream.stamp);
  const std::vector<Column> speeds = columns.numbers(map.speed);
  const Column yaw_rate = columns.numbers(map.yaw_rate);
  if (columns.error()) return *columns.error();
  Arrival arrival;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    ++counts->rows;
    double sum = 0.0;
    for (const Column& c : speeds) sum += c[i];
    const bool yaw_missing = !map.yaw_rate.empty() && !std::isfinite(yaw_rate[i]);
    if (!stamps[i] || !std::isfinite(sum) || yaw_missing) {
      ++counts->missing;
      continue;
    }
    if (!arrival.take(*stamps[i])) ++counts->backward;
    odometry_t m{};  // interval 0: the speed at the stamp
    m.utime = to_utime(*stamps[i] - map.stream.latency);
    m.speed_mps = map.speed_unit * sum / static_cast<double>(speeds.size());
    m.sigma_speed_mps = map.sigma_speed_mps;
    m.yaw_rate_radps = yaw_rate[i] * map.yaw_rate_unit;
    m.sigma_yaw_rate_radps = map.sigma_yaw_rate_radps;
    log->add(arrival.now(), m);
    ++counts->written;
  }
  return Done{};
}

/// Digits hhmmssmmm as seconds of the day; nullopt: invalid time.
std::optional<double> time_of_day_s(double digits) {
  if (!(digits >= 0.0 && digits < 240'000'000.0)) return std::nullopt;
  const auto n = static_cast<std::int64_t>(std::llround(digits));
  const std::int64_t h = n / 10'000'000, min = n / 100'000 % 100, ms = n % 100'000;
  if (h > 23 || min > 59 || ms > 60'999) return std::nullopt;  // a leap second is one
  return static_cast<double>(3600 * h + 60 * min) + 1e-3 * static_cast<double>(ms);
}

}  // namespace

Stamp ReceiverClock::device_time(Stamp arrival, Duration receiver) {
  constexpr Duration kLongest =
      std::chrono::seconds(30);  // bound of the transport delay of a message
  const Stamp origin = arrival - receiver;
  if (origin_ && (origin > *origin_ + kLongest || origin < *origin_ - kLongest)) {
    origin_.reset();
    ++steps_;
  }
  origin_ = origin_ ? std::min(*origin_, origin) : origin;
  return *origin_ + receiver;
}

InsIntegrator::Step InsIntegrator::add(Stamp stamp, const Vec3& rate, const Vec3& force,
                                       ins_t* out) {
  const bool first = !newest_;
  const bool forward = first || stamp > *newest_;
  const Duration since = first ? Duration::zero() : stamp - *newest_;
  const Vec3 mean_rate = forward ? Vec3(0.5 * (rate_ + rate)) : rate;
  const Vec3 mean_force = forward ? Vec3(0.5 * (force_ + force)) : force;
  if (forward) {
    newest_ = stamp;
    rate_ = rate;
    force_ = force;
    if (first) return Step::kFirst;
    if (since > max_gap_) return Step::kGap;
    interval_ = since;
  }
  if (interval_ == Duration::zero()) return Step::kFirst;  // its interval is unknown
  *out = ins_t{};
  out->utime = to_utime(stamp);
  out->interval_us = static_cast<std::int32_t>(interval_.count());
  to_message(Vec3(seconds(interval_) * mean_rate), out->delta_angle_rad);
  to_message(Vec3(seconds(interval_) * mean_force), out->delta_v_mps);
  out->valid = 1;
  return forward ? Step::kForward : Step::kBackward;
}

Result<std::vector<std::optional<Stamp>>> stamps_of(const tools::CsvTable& table,
                                                    const StampColumn& column) {
  constexpr double kFarthest_s = 9e9;  // of any epoch: bound of stamps
  const Result<Column> numbers = table.numbers(column.column);
  if (!numbers) return numbers.error();
  Stamps stamps(table.rows());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double v = (*numbers)[row];
    if (!std::isfinite(v)) continue;
    const std::optional<double> s = column.time_of_day ? time_of_day_s(v) : v * column.unit_s;
    if (!s || std::abs(*s) > kFarthest_s) {
      return Error{fmt::format("{}: column '{}': {} is not a time{}", table.place(row),
                               column.column, v, column.time_of_day ? " of day (hhmmssmmm)" : "")};
    }
    stamps[row] = Stamp(from_seconds(*s));
  }
  return stamps;
}

Result<ImportCounts> import_imu_gps(const ImuGpsMap& map,
                                    const std::vector<tools::CsvTable>& tables,
                                    recording::SensorLog* log) {
  Tables files(tables);
  ImportCounts counts;
  Outcome done = Done{};
  if (map.imu) done = add_imu(*map.imu, &files, log, &counts.imu.emplace());
  if (done && map.gps) done = add_gps(*map.gps, &files, log, &counts.gps.emplace());
  if (done && map.wheels) done = add_wheels(*map.wheels, &files, log, &counts.wheels.emplace());
  if (done) done = files.all_used();
  if (!done) return done.error();
  return counts;
}

}  // namespace rcs::importers
