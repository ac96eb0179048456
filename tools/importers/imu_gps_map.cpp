#include "tools/importers/imu_gps_map.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::importers {
namespace {

struct Unit {
  const char* name;
  double size;
};

constexpr double kHourly = 1.0 / 3600.0;
constexpr std::array<Unit, 3> kForceUnits = {{{"m/s2", 1.0}, {"g", 9.80665}, {"mg", 9.80665e-3}}};
constexpr std::array<Unit, 2> kRateUnits = {{{"rad/s", 1.0}, {"deg/s", kPi / 180.0}}};
constexpr std::array<Unit, 4> kSpeedUnits = {
    {{"m/s", 1.0}, {"km/h", 1e3 * kHourly}, {"mph", 1609.344 * kHourly}, {"kn", 1852.0 * kHourly}}};
constexpr std::array<Unit, 4> kTimeUnits = {{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};
constexpr const char* kTimeOfDay = "hhmmssmmm";

template <std::size_t N>
std::vector<std::string> names_of(const std::array<Unit, N>& units) {
  std::vector<std::string> names;
  names.reserve(N);
  for (const Unit& u : units) names.emplace_back(u.name);
  return names;
}

template <std::size_t N>
double size_of(const std::array<Unit, N>& units, const std::string& name) {
  for (const Unit& u : units) {
    if (name == u.name) return u.size;
  }
  return 1.0;  // invalid name: the file is rejected
}

void must_have(ParamTable* table, std::string_view key, std::string_view what) {
  if (!table->has(key)) table->fail(key, fmt::format("is missing: {}", what));
}

/// Units have no default, so that no file is imported silently in a wrong unit.
template <std::size_t N>
void get_unit(ParamTable* table, std::string_view key, const std::array<Unit, N>& units,
              double* size, std::string_view meaning) {
  const std::vector<std::string> names = names_of(units);
  std::string all;
  for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
  must_have(table, key, "one of " + all);
  std::string name = names.front();
  table->get(key, &name, names, meaning);
  *size = size_of(units, name);
}

void get_column(ParamTable* table, std::string_view key, std::string* column,
                std::string_view meaning) {
  must_have(table, key, "the name of a column");
  table->get(key, column, meaning);
}

void get_axes(ParamTable* table, std::string_view key, std::array<SignedColumn, 3>* axes,
              std::string_view meaning) {
  constexpr std::string_view kWhat =
      "three columns, for the forward, left and up axes of the vehicle, each with a leading - to "
      "invert it";
  must_have(table, key, kWhat);
  std::vector<std::string> names;
  table->get(key, &names, meaning);
  if (!table->has(key)) return;
  if (names.size() != 3) {
    table->fail(key, fmt::format("must be {}", kWhat));
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const bool turned = !names[i].empty() && names[i].front() == '-';
    (*axes)[i] = {turned ? names[i].substr(1) : names[i], turned ? -1.0 : 1.0};
    for (std::size_t j = 0; j < i; ++j) {
      if ((*axes)[j].name == (*axes)[i].name) table->fail(key, "names a column twice");
    }
  }
}

void get_stamp(ParamTable* table, const std::string& key, bool may_be_time_of_day,
               StampColumn* stamp, std::string_view meaning) {
  get_column(table, key, &stamp->column, meaning);
  const std::string unit_key = key + "_unit";
  std::vector<std::string> allowed = names_of(kTimeUnits);
  if (may_be_time_of_day) allowed.emplace_back(kTimeOfDay);
  std::string all;
  for (const std::string& n : allowed) all += (all.empty() ? "" : ", ") + n;
  must_have(table, unit_key, "one of " + all);
  std::string unit = "s";
  table->get(unit_key, &unit, allowed,
             "Unit of the stamps: a count of these units, or the digits hhmmssmmm of a time of day "
             "where allowed.");
  stamp->unit_s = size_of(kTimeUnits, unit);
  stamp->time_of_day = unit == kTimeOfDay;
}

void get_stream(ParamTable* table, StreamMap* stream) {
  table->get("file", &stream->file,
             "End of the name of the CSV file; required if several files are given.");
  get_stamp(table, "stamp", false, &stream->stamp,
            "Column of the device's stamps; minus latency_s they are times of validity.");
  double latency_s = 0.0;
  table->get("latency_s", &latency_s, {-10, 10},
             "Latency of the stamps: time of validity = stamp - latency_s.");
  stream->latency = from_seconds(latency_s);
}

ImuMap read_imu(ParamTable table) {
  ImuMap m;
  get_stream(&table, &m.stream);
  table.get("rate_file", &m.rate_file,
            "End of the name of the CSV file of the rates, paired with specific_force by equal "
            "stamps. Empty: the same file.");
  get_axes(&table, "specific_force", &m.force,
           "Columns of the specific force along the vehicle's forward, left and up axes; a leading "
           "- inverts one. At rest up reads +g.");
  get_unit(&table, "specific_force_unit", kForceUnits, &m.force_unit,
           "Unit of the columns specific_force.");
  get_axes(&table, "rate", &m.rate,
           "Columns of the angular rates about the vehicle's forward, left and up axes; a leading "
           "- inverts one.");
  get_unit(&table, "rate_unit", kRateUnits, &m.rate_unit, "Unit of the columns rate.");
  Vec3 rpy_deg = Vec3::Zero();
  table.get("mount_rpy_deg", &rpy_deg, {-180, 180},
            "Roll, pitch and yaw of the IMU in the vehicle frame after the choice of the columns.");
  m.q_vehicle_imu = exp_so3(radians(rpy_deg.z()) * Vec3::UnitZ()) *
                    exp_so3(radians(rpy_deg.y()) * Vec3::UnitY()) *
                    exp_so3(radians(rpy_deg.x()) * Vec3::UnitX());
  table.get_ms("max_gap_ms", &m.max_gap, {1, 500},
               "Longest gap between two rows that is integrated over; a longer gap is a silence of "
               "the INS.");
  return m;
}

void read_gps_sigma(ParamTable* table, GpsMap* m) {
  std::string kind = "sigma";
  table->get("sigma_columns", &m->sigma_columns,
             "Columns of the position uncertainty: east, north, up. Instead of sigma_m.");
  table->get("sigma_columns_are", &kind, {"sigma", "variance"},
             "Content of sigma_columns: standard deviations or variances.");
  table->get("sigma_scale", &m->sigma_scale, {0.01, 100},
             "Factors on the standard deviations of sigma_columns: east, north, up [1]. Larger: "
             "GPS weighs less.");
  table->get(
      "sigma_m", &m->sigma_m, {0.001, 200},
      "Constant standard deviation of the position: east, north, up. Instead of sigma_columns.");
  m->variances = kind == "variance";
  const bool columns = table->has("sigma_columns");
  if (columns == table->has("sigma_m")) {
    table->fail("sigma_m", columns ? "and sigma_columns are both given: use one"
                                   : "is missing: three numbers (east, north, up), or "
                                     "sigma_columns; WM weighs fixes by it");
  }
  if (columns && m->sigma_columns.size() != 3) {
    table->fail("sigma_columns", "must be three columns: east, north, up");
  }
  for (const char* key : {"sigma_columns_are", "sigma_scale"}) {
    if (!columns && table->has(key)) table->fail(key, "requires sigma_columns");
  }
}

GpsMap read_gps(ParamTable table) {
  GpsMap m;
  get_stream(&table, &m.stream);
  if (table.has("receiver_stamp")) {
    m.receiver.emplace();
    get_stamp(&table, "receiver_stamp", true, &*m.receiver,
              "Column of the receiver's own time of the fix; it replaces the device's stamps as "
              "the time of validity.");
  }
  get_column(&table, "lat_deg", &m.lat, "Column of the latitude, in degrees.");
  get_column(&table, "lon_deg", &m.lon, "Column of the longitude, in degrees.");
  get_column(&table, "height_m", &m.height,
             "Column of the height, in metres; height_kind states its reference.");
  std::string kind = "ellipsoidal";
  must_have(&table, "height_kind", "ellipsoidal (above WGS84) or orthometric (above the geoid)");
  table.get("height_kind", &kind, {"ellipsoidal", "orthometric"},
            "Reference of the column height_m: above the WGS84 ellipsoid or above the geoid.");
  m.ellipsoidal = kind == "ellipsoidal";
  table.get("undulation_m", &m.undulation_m, {-110, 90},
            "Geoid undulation (geoid above ellipsoid) in the area, for orthometric heights.");
  if (!m.ellipsoidal) must_have(&table, "undulation_m", "of the geoid above the ellipsoid there");
  if (m.ellipsoidal && table.has("undulation_m")) {
    table.fail("undulation_m", "must not be given for ellipsoidal heights");
  }
  table.get(
      "speed", &m.speed,
      "Column of the speed over ground; needs course_deg. Not given: fixes without velocity.");
  table.get("course_deg", &m.course, "Column of the course over ground, in degrees; needs speed.");
  if (table.has("speed") != table.has("course_deg")) {
    table.fail("speed", "and course_deg belong together: both or neither");
  }
  if (table.has("speed")) {
    get_unit(&table, "speed_unit", kSpeedUnits, &m.speed_unit, "Unit of the column speed.");
    must_have(&table, "sigma_speed_mps", "of each horizontal axis, in [0.001, 50] (m/s)");
    table.get("sigma_speed_mps", &m.sigma_speed_mps, {0.001, 50},
              "Standard deviation of the velocity on each horizontal axis.");
    table.get("climb", &m.climb, {0, 1},
              "Standard deviation of the unknown vertical velocity as a share of the speed [1].");
  }
  read_gps_sigma(&table, &m);
  table.get("changed_by", &m.changed_by,
            "Columns of which one must change for a row to be a new fix. Empty: every row is one.");
  table.get("zero_is_missing", &m.zero_is_missing,
            "Columns in which 0 means a missing value; rows with one are skipped.");
  table.get("fix", &m.fix, "Column of the fix status; rows below fix_min are no fix.");
  table.get("fix_min", &m.fix_min, {-10, 10},
            "Smallest value of the column fix with which a row is a fix.");
  if (table.has("fix") != table.has("fix_min")) {
    table.fail("fix", "and fix_min belong together: both or neither");
  }
  table.get("satellites", &m.satellites,
            "Column of the number of satellites used. Not given: unknown.");
  table.get("hdop", &m.hdop, "Column of the horizontal dilution of precision. Not given: unknown.");
  table.get("vdop", &m.vdop, "Column of the vertical dilution of precision. Not given: unknown.");
  return m;
}

WheelMap read_wheels(ParamTable table) {
  WheelMap m;
  get_stream(&table, &m.stream);
  must_have(&table, "speed", "a list of columns; their mean is used");
  table.get("speed", &m.speed,
            "Columns of the wheel speeds; their mean is the speed of the vehicle.");
  if (table.has("speed") && m.speed.empty()) table.fail("speed", "names no column");
  get_unit(&table, "speed_unit", kSpeedUnits, &m.speed_unit, "Unit of the columns speed.");
  must_have(&table, "sigma_speed_mps", "in [0.001, 50] (m/s)");
  table.get("sigma_speed_mps", &m.sigma_speed_mps, {0.001, 50},
            "Standard deviation of the wheel speed.");
  table.get("yaw_rate", &m.yaw_rate,
            "Column of the yaw rate, positive to the left. Not given: unknown.");
  if (table.has("yaw_rate")) {
    get_unit(&table, "yaw_rate_unit", kRateUnits, &m.yaw_rate_unit, "Unit of the column yaw_rate.");
    must_have(&table, "sigma_yaw_rate_radps", "in [1e-5, 10] (rad/s)");
    table.get("sigma_yaw_rate_radps", &m.sigma_yaw_rate_radps, {1e-5, 10},
              "Standard deviation of the yaw rate.");
  }
  return m;
}

}  // namespace

Result<ImuGpsMap> load_imu_gps_map(const ParamFile& file) {
  ParamTable root = file.root();
  ImuGpsMap map;
  if (root.has("imu")) map.imu = read_imu(root.table("imu"));
  if (root.has("gps")) map.gps = read_gps(root.table("gps"));
  if (root.has("odometry")) map.wheels = read_wheels(root.table("odometry"));
  if (Outcome read_all = file.finish({}); !read_all) return read_all.error();
  if (!map.imu && !map.gps && !map.wheels) {
    return Error{file.name() + ": no sensor: [imu], [gps] or [odometry] is required"};
  }
  return map;
}

}  // namespace rcs::importers
