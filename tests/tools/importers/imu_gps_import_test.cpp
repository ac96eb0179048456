#include "tools/importers/imu_gps_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "lcmtypes/convert.h"

namespace rcs::importers {
namespace {

using testing::HasSubstr;

constexpr const char* kImu =
    "[imu]\nfile = 'imu.csv'\nstamp = 't'\nstamp_unit = 's'\n"
    "specific_force = ['-az', '-ax', 'ay']\nspecific_force_unit = 'g'\n"
    "rate = ['-wz', '-wx', 'wy']\nrate_unit = 'deg/s'\n";
constexpr const char* kGps =
    "[gps]\nfile = 'gps.csv'\nstamp = 'ms'\nstamp_unit = 'ms'\n"
    "lat_deg = 'lat'\nlon_deg = 'lon'\nheight_m = 'h'\nheight_kind = 'orthometric'\n"
    "undulation_m = 44\nspeed = 'v'\ncourse_deg = 'c'\nspeed_unit = 'km/h'\n"
    "sigma_speed_mps = 0.3\n";
constexpr const char* kSigma = "sigma_m = [2, 3, 5]\n";

Result<ImuGpsMap> map_of(const std::string& text) {
  const Result<ParamFile> file = ParamFile::parse(text, "map.toml");
  return file ? load_imu_gps_map(*file) : Result<ImuGpsMap>(file.error());
}

tools::CsvTable table(const std::string& name, const std::string& text) {
  return tools::CsvTable::parse(text, name).value();
}

struct Imported {
  ImportCounts counts;
  recording::SensorLog log;

  template <class Message>
  [[nodiscard]] std::vector<Message> all() const {
    std::vector<Message> messages;
    for (const recording::SensorLog::Event& e : log.events()) {
      if (const auto* m = std::get_if<Message>(&e.message)) messages.push_back(*m);
    }
    return messages;
  }
};

Imported import(const std::string& map_text, const std::vector<tools::CsvTable>& tables) {
  Imported out;
  const Result<ImuGpsMap> map = map_of(map_text);
  EXPECT_TRUE(map) << (map ? "" : map.error().message);
  if (!map) return out;
  const Result<ImportCounts> counts = import_imu_gps(*map, tables, &out.log);
  EXPECT_TRUE(counts) << (counts ? "" : counts.error().message);
  if (counts) out.counts = *counts;
  return out;
}

std::string complaint(const std::string& map_text, const std::vector<tools::CsvTable>& tables) {
  const Result<ImuGpsMap> map = map_of(map_text);
  if (!map) return map.error().message;
  recording::SensorLog log;
  const Result<ImportCounts> counts = import_imu_gps(*map, tables, &log);
  return counts ? "accepted" : counts.error().message;
}

TEST(ImuGpsImport, ARolledImuAtRestMeasuresOneGUpAndTurnsAboutTheVehicleAxes) {
  // Its y is up; the vehicle turns to the left by 90 deg/s and pitches its nose down by 9 deg/s.
  const Imported in = import(kImu, {table("imu.csv",
                                          "t,ax,ay,az,wx,wy,wz\n"
                                          "10,0,1,0,-9,90,0\n10.02,0,1,0,-9,90,0\n")});
  const std::vector<ins_t> ins = in.all<ins_t>();
  ASSERT_EQ(ins.size(), 1U);
  EXPECT_EQ(ins[0].utime, 10'020'000);
  EXPECT_EQ(ins[0].interval_us, 20'000);
  EXPECT_EQ(ins[0].valid, 1);
  EXPECT_LT((from_message(ins[0].delta_v_mps) - Vec3(0, 0, 0.02 * 9.80665)).norm(), 1e-12);
  EXPECT_LT(
      (from_message(ins[0].delta_angle_rad) - Vec3(0, 0.02 * radians(9.0), 0.02 * radians(90.0)))
          .norm(),
      1e-12);
}

TEST(ImuGpsImport, AMountRotationIsAppliedAfterTheColumnMapping) {
  // The device's nose is 30 deg down: at rest gravity appears along its x, backwards.
  const std::string map = std::string(kImu) + "mount_rpy_deg = [0, 30, 0]\n";
  const Imported in =
      import(map, {table("imu.csv",
                         "t,ax,ay,az,wx,wy,wz\n"
                         "0,0,0.8660254037844386,0.5,0,0,0\n1e-1,0,0.8660254037844386,0.5,0,0,0")});
  const std::vector<ins_t> ins = in.all<ins_t>();
  ASSERT_EQ(ins.size(), 1U);
  EXPECT_LT((from_message(ins[0].delta_v_mps) - Vec3(0, 0, 0.980665)).norm(), 1e-9);
}

TEST(InsIntegrator, TheIncrementIsTheIntegralOfTheStraightLine) {
  InsIntegrator integrator(from_seconds(0.2));
  using Step = InsIntegrator::Step;
  ins_t m{};
  const auto add = [&](double t_s, double f) {
    return integrator.add(Stamp(from_seconds(t_s)), Vec3(0, 0, 1), Vec3(f, 0, 0), &m);
  };
  EXPECT_EQ(add(1.0, 2.0), Step::kFirst);
  EXPECT_EQ(add(1.1, 4.0), Step::kForward);
  EXPECT_NEAR(m.delta_v_mps[0], 0.3, 1e-12);
  // A backward stamp is replaced: it counts for the interval before.
  EXPECT_EQ(add(0.5, 6.0), Step::kBackward);
  EXPECT_EQ(m.utime, 500'000);
  EXPECT_EQ(m.interval_us, 100'000);
  EXPECT_NEAR(m.delta_v_mps[0], 0.6, 1e-12);
  // The next one continues from the newest.
  EXPECT_EQ(add(1.2, 4.0), Step::kForward);
  EXPECT_NEAR(m.delta_v_mps[0], 0.4, 1e-12);
  EXPECT_EQ(add(1.5, 4.0), Step::kGap);
  EXPECT_EQ(add(1.55, 4.0), Step::kForward);
  EXPECT_EQ(m.interval_us, 50'000);
}

TEST(ImuGpsImport, MissingCellsAndBackwardStampsAreCountedAndNothingArrivesInThePast) {
  const Imported in = import(kImu, {table("imu.csv",
                                          "t,ax,ay,az,wx,wy,wz\n"
                                          "1.00,0,1,0,0,0,0\n"
                                          "1.02,0,nan,0,0,0,0\n"  // bridged by the next
                                          "1.04,0,1,0,0,0,0\n"
                                          ",0,1,0,0,0,0\n"
                                          "0.50,0,1,0,0,0,0\n"
                                          "1.04,0,1,0,0,0,0\n"
                                          "1.06,0,1,0,0,0\n"
                                          "2.00,0,1,0,0,0,0\n"
                                          "2.02,0,1,0,0,0,0\n")});
  EXPECT_EQ(in.counts.imu->rows, 9);
  EXPECT_EQ(in.counts.imu->missing, 3);
  EXPECT_EQ(in.counts.imu->backward, 2);
  EXPECT_EQ(in.counts.imu->gaps, 1);
  EXPECT_EQ(in.counts.imu->written, 4);
  const std::vector<ins_t> ins = in.all<ins_t>();
  ASSERT_EQ(ins.size(), 4U);
  EXPECT_EQ(ins[0].interval_us, 40'000);
  EXPECT_EQ(ins[1].utime, 500'000);
  Stamp before = Stamp::min();
  for (const recording::SensorLog::Event& e : in.log.events()) {
    EXPECT_GE(e.arrival, before);
    before = e.arrival;
  }
}

TEST(ImuGpsImport, RatesOfAnotherFileArePairedByStamp) {
  const std::string map = std::string(kImu) + "rate_file = 'gyro.csv'\n";
  const Imported in = import(
      map, {table("x/imu.csv", "t,ax,ay,az\n1.00,0,1,0\n1.02,0,1,0\n1.04,0,1,0\n1.06,0,1,0\n"),
            table("x/gyro.csv", "t,wx,wy,wz\n0.98,0,9,0\n1.00,0,1,0\n1.04,0,3,0\n1.06,0,5,0\n")});
  EXPECT_EQ(in.counts.imu->unpaired, 1);
  const std::vector<ins_t> ins = in.all<ins_t>();
  ASSERT_EQ(ins.size(), 2U);
  EXPECT_NEAR(ins[0].delta_angle_rad[2], 0.04 * radians(2.0), 1e-12);
  EXPECT_NEAR(ins[1].delta_angle_rad[2], 0.02 * radians(4.0), 1e-12);
}

TEST(ImuGpsImport, AFixHasItsUnitsItsVelocityAndItsKindOfHeight) {
  const Imported in = import(std::string(kGps) + kSigma + "latency_s = 0.25\nclimb = 0.1\n",
                             {table("gps.csv",
                                    "ms,lat,lon,h,v,c\n"
                                    "1000,51,13.5,110,36,90\n2000,51,13.5,110,,90\n")});
  const std::vector<gps_fix_t> fixes = in.all<gps_fix_t>();
  ASSERT_EQ(fixes.size(), 2U);
  const gps_fix_t& m = fixes[0];
  EXPECT_EQ(m.utime, 750'000) << "valid before its arrival";
  EXPECT_EQ(in.log.events()[0].arrival, from_utime(1'000'000));
  EXPECT_EQ(m.lat_deg, 51.0);
  EXPECT_EQ(m.lon_deg, 13.5);
  EXPECT_TRUE(m.height_kind == gps_fix_t::HEIGHT_ORTHOMETRIC);
  EXPECT_EQ(m.undulation_m, 44.0);
  EXPECT_EQ(from_message(m.sigma_enu_m), Vec3(2, 3, 5));
  EXPECT_EQ(m.has_velocity, 1);
  EXPECT_LT((from_message(m.v_enu_mps) - Vec3(10, 0, 0)).norm(), 1e-12) << "eastward";
  EXPECT_NEAR(m.sigma_v_enu_mps[2], std::hypot(0.3, 1.0), 1e-12);
  EXPECT_EQ(fixes[1].has_velocity, 0) << "a position without a speed is valid";
  EXPECT_EQ(in.counts.gps->without_velocity, 1);
}

TEST(ImuGpsImport, RowsWithoutAFixAreSkippedAndCounted) {
  const std::string map = std::string(kGps) +
                          "sigma_columns = ['s', 's', 's']\nsigma_columns_are = 'variance'\n"
                          "sigma_scale = [1, 1, 2]\nchanged_by = ['n']\nzero_is_missing = ['h']\n"
                          "fix = 'fix'\nfix_min = 2\nsatellites = 'n'\n";
  const Imported in = import(map, {table("gps.csv",
                                         "ms,lat,lon,h,v,c,s,n,fix\n"
                                         "1000,51,13,110,0,0,9,5,3\n"
                                         "1020,51,13,110,0,0,9,5,3\n"  // repeated
                                         "1100,51,13,0,0,0,9,6,3\n"    // no height
                                         "1200,51,13,110,0,0,9,7,1\n"  // no fix
                                         "1300,151,13,110,0,0,9,8,3\n"
                                         "1400,51,13,110,0,0,0,9,3\n"  // sigma 0
                                         "1500,51,,110,0,0,9,10,3\n"
                                         "1600,51,13,110,0,0,9,11,3\n")});
  EXPECT_EQ(in.counts.gps->rows, 8);
  EXPECT_EQ(in.counts.gps->unchanged, 1);
  EXPECT_EQ(in.counts.gps->missing, 2);
  EXPECT_EQ(in.counts.gps->no_fix, 1);
  EXPECT_EQ(in.counts.gps->implausible, 2);
  const std::vector<gps_fix_t> fixes = in.all<gps_fix_t>();
  ASSERT_EQ(fixes.size(), 2U);
  EXPECT_EQ(from_message(fixes[1].sigma_enu_m), Vec3(3, 3, 6));
  EXPECT_EQ(fixes[1].satellites, 11);
}

TEST(ReceiverClock, DelayedFixesHaveTheirMeasurementTime) {
  // A fix each 0.1 s by the receiver; the device receives it 20 ms later, or much later.
  ReceiverClock clock;
  const double delay_s[] = {0.02, 0.05, 0.02, 1.5, 4.0, 0.02};
  for (int k = 0; k < 6; ++k) {
    const Duration receiver = from_seconds(86'000.0 + 0.1 * k);
    const Stamp measured = Stamp(from_seconds(500.0 + 0.1 * k));
    const Stamp arrival = measured + from_seconds(delay_s[k]);
    EXPECT_EQ(clock.device_time(arrival, receiver), measured + from_seconds(0.02)) << k;
  }
  EXPECT_EQ(clock.steps(), 0);
  // Midnight: the time of day restarts.
  EXPECT_EQ(clock.device_time(from_utime(900'000'000), from_seconds(1.0)), from_utime(900'000'000));
  EXPECT_EQ(clock.steps(), 1);
}

TEST(ImuGpsImport, TheTimeOfDayOfAReceiverIsParsedByDigits) {
  const std::string map =
      std::string(kGps) + kSigma + "receiver_stamp = 'utc'\nreceiver_stamp_unit = 'hhmmssmmm'\n";
  const auto with = [](const std::string& utc) {
    return table("gps.csv",
                 "ms,lat,lon,h,v,c,utc\n1000,51,13,110,0,0,125959900\n"
                 "1500,51,13,110,0,0," +
                     utc + "\n");
  };
  const std::vector<gps_fix_t> fixes = import(map, {with("130000100")}).all<gps_fix_t>();
  ASSERT_EQ(fixes.size(), 2U);
  EXPECT_EQ(fixes[1].utime - fixes[0].utime, 200'000);
  EXPECT_THAT(complaint(map, {with("126100000")}), HasSubstr("gps.csv:3: column 'utc'"));
  EXPECT_THAT(complaint(map, {with("-5")}), HasSubstr("hhmmssmmm"));
}

TEST(ImuGpsImport, WheelsAreTheMeanOfTheirColumns) {
  const Imported in = import(
      "[odometry]\nstamp = 't'\nstamp_unit = 'us'\nspeed = ['l', 'r']\nspeed_unit = 'km/h'\n"
      "sigma_speed_mps = 0.1\nyaw_rate = 'w'\nyaw_rate_unit = 'deg/s'\n"
      "sigma_yaw_rate_radps = 0.02\n",
      {table("w.csv", "t,l,r,w\n5,36,72,90\n6,36,,0\n")});
  EXPECT_EQ(in.counts.wheels->missing, 1);
  const std::vector<odometry_t> wheels = in.all<odometry_t>();
  ASSERT_EQ(wheels.size(), 1U);
  EXPECT_EQ(wheels[0].utime, 5);
  EXPECT_NEAR(wheels[0].speed_mps, 15.0, 1e-12);
  EXPECT_NEAR(wheels[0].yaw_rate_radps, kPi / 2, 1e-12);
  EXPECT_EQ(wheels[0].sigma_yaw_rate_radps, 0.02);
}

TEST(ImuGpsImport, FilesAreFoundByTheirNameSuffix) {
  const tools::CsvTable imu = table("imu.csv", "t,ax,ay,az,wx,wy,wz\n");
  EXPECT_EQ(complaint(kImu, {imu}), "accepted");
  EXPECT_THAT(complaint(kImu, {table("x.csv", "t\n")}), HasSubstr("ends in 'imu.csv'"));
  EXPECT_THAT(complaint(kImu, {imu, imu}), HasSubstr("two files end in 'imu.csv'"));
  EXPECT_THAT(complaint(kImu, {imu, table("x.csv", "t\n")}),
              HasSubstr("x.csv: the column file does not use this file"));
  EXPECT_THAT(complaint(kImu, {table("imu.csv", "t,ax,ay,az,wx,wy\n")}),
              HasSubstr("imu.csv: no column 'wz'"));
  EXPECT_THAT(complaint(kImu, {table("imu.csv", "t,ax,ay,az,wx,wy,wz\n1,2,3,4,5,6,up\n")}),
              HasSubstr("imu.csv:2: column 'wz': 'up'"));
  EXPECT_THAT(complaint(kImu, {table("imu.csv", "t,ax,ay,az,wx,wy,wz\n1e99,2,3,4,5,6,7\n")}),
              HasSubstr("imu.csv:2: column 't'"));
}

TEST(ImuGpsMap, ErrorsNameFileLineKeyAndAllowedValues) {
  const auto refused = [](const std::string& text) { return complaint(text, {}); };
  const std::string imu(kImu), gps = std::string(kGps) + kSigma;
  const auto without = [](std::string text, const std::string& line) {
    const std::size_t at = text.find(line);
    EXPECT_NE(at, std::string::npos) << line;
    return text.erase(at, text.find('\n', at) + 1 - at);
  };
  EXPECT_THAT(refused(""), HasSubstr("map.toml: no sensor"));
  EXPECT_THAT(refused(imu + "max_gap_ms = 900\n"),
              HasSubstr("map.toml:9: [imu] max_gap_ms = 900: not in [1, 500] (ms)"));
  EXPECT_THAT(refused(imu + "gap = 1\n"), HasSubstr("map.toml:9"));
  EXPECT_THAT(refused(imu + "[lidar]\n"), HasSubstr("lidar"));
  EXPECT_THAT(refused(without(imu, "rate_unit")), HasSubstr("one of rad/s, deg/s"));
  EXPECT_THAT(refused(without(imu, "stamp_unit")), HasSubstr("one of s, ms, us, ns"));
  EXPECT_THAT(refused(without(imu, "specific_force =")), HasSubstr("forward, left and up"));
  EXPECT_THAT(refused(without(imu, "rate =") + "rate = ['a', '-a', 'b']\n"), HasSubstr("twice"));
  EXPECT_THAT(refused(without(imu, "rate =") + "rate = ['a', 'b']\n"), HasSubstr("three columns"));
  EXPECT_THAT(refused(kGps), HasSubstr("WM weighs fixes by it"));
  EXPECT_THAT(refused(gps + "sigma_columns = ['a', 'b', 'c']\n"), HasSubstr("are both given"));
  EXPECT_THAT(refused(without(gps, "undulation_m")), HasSubstr("undulation_m: is missing"));
  EXPECT_THAT(refused(without(gps, "height_kind")), HasSubstr("height_kind: is missing"));
  EXPECT_THAT(refused(without(gps, "course_deg")), HasSubstr("both or neither"));
  EXPECT_THAT(refused(gps + "fix = 'f'\n"), HasSubstr("both or neither"));
  EXPECT_THAT(refused(gps + "receiver_stamp = 'x'\nreceiver_stamp_unit = 'h'\n"),
              HasSubstr("hhmmssmmm"));
}

TEST(ImuGpsMap, ShippedMapsLoad) {
  const char* source = std::getenv("RCS_SOURCE_DIR");
  for (const char* name : {"balzer82", "husky"}) {
    const Result<ParamFile> file = ParamFile::load(std::string(source == nullptr ? "." : source) +
                                                   "/config/import/" + name + ".toml");
    ASSERT_TRUE(file) << file.error().message;
    const Result<ImuGpsMap> map = load_imu_gps_map(*file);
    ASSERT_TRUE(map) << map.error().message;
    EXPECT_TRUE(map->imu && map->gps) << name;
  }
}

}  // namespace
}  // namespace rcs::importers
