#include "sim/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "sim/terrain/clearance.h"
#include "sim/vehicle/contact.h"
#include "sim/vehicle/scripted_drive.h"

namespace rcs::sim {
namespace {

constexpr Duration kTransport = std::chrono::milliseconds(1);  // from a sensor to its reader
constexpr double kTruthInterval_s = 0.01;
constexpr std::size_t kCommandsWaiting = 64;
// Extent of the world beyond the range of the LADAR.
constexpr double kReachScripted_m = 20.0;
constexpr double kReachCommanded_m = 40.0;

template <class T>
void encode(const char* channel, const T& message, SourceEvent* event) {
  const int size = message.getEncodedSize();
  event->channel = channel;
  event->data.resize(static_cast<std::size_t>(size));
  RCS_CHECK(message.encode(event->data.data(), 0, size) == size);
}

// A scripted course is free of objects; a commanded vehicle must avoid them.
World make_world(const Scenario& scenario, const Course& course) {
  const double by_mode_m = scenario.commanded ? kReachCommanded_m : kReachScripted_m;
  const double reach_m = scenario.world.reach_m > 0.0 ? scenario.world.reach_m : by_mode_m;
  return {scenario.world, scenario.dem,
          scenario.commanded ? scenario.course.waypoints_world : course.points(),
          scenario.beam.max_range_m + reach_m};
}

CoursePoint start_of(const Scenario& scenario) {
  const std::vector<Vec2>& waypoints = scenario.course.waypoints_world;
  const Vec2 leg = waypoints[1] - waypoints[0];
  return {waypoints[0], std::atan2(leg.y(), leg.x())};
}

double drive_duration(const Scenario& scenario, const Course& course) {
  return scenario.duration_s > 0.0 ? scenario.duration_s : course.duration_s() + 1.0;
}

std::int64_t run_id_of(const Scenario& s) {
  std::string text = fmt::format("{} {} {} {} {}", s.seed, s.world.seed, s.duration_s,
                                 s.ins.grade_name, s.commanded);
  for (const Vec2& p : s.course.waypoints_world) text += fmt::format(" {} {}", p.x(), p.y());
  for (const Outage& o : s.gps.outages) text += fmt::format(" {} {}", o.begin_s, o.length_s);
  for (const ActorScript& a : s.actors) {
    for (const Vec2& p : a.waypoints_world) text += fmt::format(" {} {}", p.x(), p.y());
  }
  return id_of(text);
}

}  // namespace

Simulator::Simulator(const Scenario& scenario)
    : scenario_(scenario),
      publisher_{run_id_of(scenario), id_of("sim")},
      course_(scenario.course),
      world_(make_world(scenario, course_)),
      actors_(scenario.actors),
      duration_s_(drive_duration(scenario, course_)),
      ins_(scenario.ins, Planet::at(scenario.datum), scenario.seed),
      odometer_(scenario.odometry, scenario.seed),
      gps_(scenario.gps, scenario.datum, scenario.seed),
      imager_(scenario.imager, scenario.beam, scenario.mount, scenario.seed),
      spinning_(scenario.spinning, scenario.beam, scenario.mount, scenario.seed),
      last_place_world_(scenario.course.waypoints_world.front()) {
  if (scenario_.commanded) {
    commanded_.emplace(scenario_.drive, scenario_.vehicle, &world_, start_of(scenario_));
  } else {
    scripted_ = drive(course_, world_, scenario_.vehicle, duration_s_);
  }
  if (actors_.size() > 0) {
    imager_.set_actors(&actors_);
    spinning_.set_actors(&actors_);
    actors_.observe({last_place_world_, 0.0}, 0.0, 0.0);
  }
  schedule_periodic(kIns, scenario_.ins.interval_s, kTransport);
  schedule_periodic(kOdometry, scenario_.odometry.interval_s, kTransport);
  schedule_periodic(kTruth, kTruthInterval_s, Duration(0));
  schedule_gps();
  schedule_ladar();
}

Stamp Simulator::peek() {
  Stamp first = Stamp::max();
  for (const Schedule& s : schedule_) first = std::min(first, s.due);
  return first;
}

void Simulator::take(SourceEvent* event) {
  const Stamp due = peek();
  RCS_CHECK(due != Stamp::max());
  if (commanded_) {
    receive_commands();
    commanded_->go_on_to(seconds(due - kStart));
  }
  std::size_t sensor = 0;
  while (schedule_[sensor].due != due) ++sensor;
  ++schedule_[sensor].seq;
  switch (sensor) {
    case kIns:
      return emit_ins(event);
    case kOdometry:
      return emit_odometry(event);
    case kGps:
      return emit_gps(event);
    case kTruth:
      return emit_truth(event);
    default:
      break;
  }
  scenario_.ladar == LadarKind::kImager ? emit_ranges(event) : emit_points(event);
}

void Simulator::listen(Bus* bus, Duration shift) {
  RCS_CHECK(commanded_);
  commands_.emplace(bus, channel::kBgDrive, kCommandsWaiting, ChannelOwner::Rule::kOne);
  bus_shift_ = shift;
}

void Simulator::receive_commands() {
  if (!commands_) return;
  for (; !commands_->empty(); commands_->pop()) {
    const drive_t& m = *commands_->front();
    const Publisher from{m.run_id, m.publisher_id};
    const bool releases = stopped_by_ && m.emergency_stop == 0;
    if (releases && from.run_id != stopped_by_->run_id) {
      ++releases_refused_;
      continue;
    }
    const std::int64_t accepted = commanded_->model().account().taken;
    command(m, commands_->front_arrival() - bus_shift_, bus_shift_);
    // What is stale or implausible neither stops nor releases.
    if (commanded_->model().account().taken == accepted) continue;
    if (m.emergency_stop != 0) {
      stopped_by_ = from;
    } else {
      stopped_by_.reset();
    }
  }
}

std::int64_t Simulator::rejected_commands() const {
  return releases_refused_ + (commands_ ? commands_->account().rejected : 0);
}

void Simulator::command(const drive_t& message, Stamp arrival) {
  RCS_CHECK(commanded_);
  command(message, arrival, Duration(0));
}

// As floating-point numbers: no stamp in a message can overflow them.
void Simulator::command(const drive_t& m, Stamp arrival, Duration shift) {
  const auto time_s = [](std::int64_t utime, Duration origin) {
    return 1e-6 * (static_cast<double>(utime) - static_cast<double>(origin.count()));
  };
  const Duration start = kStart.time_since_epoch();
  DriveCommand c;
  c.issued_s = time_s(m.utime, start + shift);
  c.valid_until_s = time_s(m.valid_until_utime, start + shift);
  c.speed_mps = m.speed_mps;
  c.curvature_1pm = m.curvature_1pm;
  c.accel_limit_mps2 = m.accel_limit_mps2;
  c.brake = m.brake != 0;
  c.emergency_stop = m.emergency_stop != 0;
  commanded_->command(c, time_s(to_utime(arrival), start));
}

PriorMap Simulator::prior_map(double cell_m) const {
  PriorMapParams params = scenario_.prior_map;
  if (cell_m > 0.0) params.cell_m = cell_m;
  const std::vector<Vec2> points = course_.points();
  Region region{points.front(), points.front()};
  for (const Vec2& p : points) {
    region.low_world_m = region.low_world_m.cwiseMin(p);
    region.high_world_m = region.high_world_m.cwiseMax(p);
  }
  const Vec2 margin = Vec2::Constant(params.margin_m);
  region.low_world_m -= margin;
  region.high_world_m += margin;
  return make_prior_map(world_.relief(), scenario_.datum, region, params, scenario_.seed);
}

// The next message measures interval `count + 1`.
void Simulator::schedule_periodic(Sensor sensor, double interval_s, Duration delay) {
  Schedule& s = schedule_[sensor];
  const double end_s = static_cast<double>(s.count + 1) * interval_s;
  s.due = end_s <= duration_s_ ? kStart + from_seconds(end_s) + delay : Stamp::max();
}

void Simulator::emit_ins(SourceEvent* event) {
  Schedule& s = schedule_[kIns];
  const double end_s = static_cast<double>(++s.count) * scenario_.ins.interval_s;
  const InertialIncrement increment = ins_.measure(vehicle(), end_s);
  ins_t m{};
  m.utime = to_utime(kStart + from_seconds(end_s));
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  m.interval_us = static_cast<std::int32_t>(from_seconds(scenario_.ins.interval_s).count());
  to_message(increment.delta_angle, m.delta_angle_rad);
  to_message(increment.delta_v, m.delta_v_mps);
  m.valid = 1;
  encode(channel::kIns, m, event);
  schedule_periodic(kIns, scenario_.ins.interval_s, kTransport);
}

void Simulator::emit_odometry(SourceEvent* event) {
  Schedule& s = schedule_[kOdometry];
  const OdometryParams& params = scenario_.odometry;
  const double end_s = static_cast<double>(++s.count) * params.interval_s;
  const WheelMotion motion = odometer_.measure(vehicle(), end_s);
  odometry_t m{};
  m.utime = to_utime(kStart + from_seconds(end_s));
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  m.interval_us = static_cast<std::int32_t>(from_seconds(params.interval_s).count());
  m.speed_mps = motion.speed_mps;
  m.sigma_speed_mps = params.sigma_speed_mps;
  m.yaw_rate_radps = motion.yaw_rate_radps;
  m.sigma_yaw_rate_radps = params.sigma_yaw_rate_radps;
  encode(channel::kOdometry, m, event);
  schedule_periodic(kOdometry, params.interval_s, kTransport);
}

// Schedules the next fix that is not within an outage.
void Simulator::schedule_gps() {
  Schedule& s = schedule_[kGps];
  const GpsParams& params = scenario_.gps;
  double time_s = 0.0;
  do {
    time_s = static_cast<double>(++s.count) * params.interval_s;
  } while (time_s <= duration_s_ && gps_.silent_at(time_s));
  const bool lost = params.lost_after_m > 0.0 && driven_m_ >= params.lost_after_m;
  s.due = time_s <= duration_s_ && !lost ? kStart + from_seconds(time_s + params.latency_s)
                                         : Stamp::max();
}

void Simulator::emit_gps(SourceEvent* event) {
  const Schedule& s = schedule_[kGps];
  const GpsParams& params = scenario_.gps;
  // The noise of fixes within an outage is drawn, too.
  GpsFix fix;
  double time_s = 0.0;
  while (fixes_ < s.count) {
    time_s = static_cast<double>(++fixes_) * params.interval_s;
    (void)gps_.measure(vehicle(), time_s, &fix);
  }
  gps_fix_t m{};
  m.utime = to_utime(kStart + from_seconds(time_s));
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  m.lat_deg = degrees(fix.antenna.lat_rad);
  m.lon_deg = degrees(fix.antenna.lon_rad);
  m.height_m = fix.antenna.height.m;
  m.height_kind = gps_fix_t::HEIGHT_ELLIPSOIDAL;
  m.undulation_m = params.undulation_m;
  to_message(Vec3::Constant(fix.sigma_m), m.sigma_enu_m);
  m.has_velocity = 1;
  to_message(fix.v_world, m.v_enu_mps);
  to_message(Vec3::Constant(fix.sigma_v_mps), m.sigma_v_enu_mps);
  m.fix_type = gps_fix_t::FIX_FLOAT;
  m.satellites = static_cast<std::int16_t>(fix.satellites);
  m.hdop = fix.hdop;
  m.vdop = fix.vdop;
  encode(channel::kGpsFix, m, event);
  schedule_gps();
}

int Simulator::facets() const {
  return scenario_.ladar == LadarKind::kImager ? scenario_.imager.facets
                                               : scenario_.spinning.sectors;
}

// Whole microseconds, without drift. Facets are numbered consecutively over all scans.
Duration Simulator::facet_start(std::int64_t facet) const {
  const double period_s = scenario_.ladar == LadarKind::kImager ? scenario_.imager.period_s
                                                                : scenario_.spinning.period_s;
  return Duration(facet * from_seconds(period_s).count() / facets());
}

void Simulator::schedule_ladar() {
  Schedule& s = schedule_[kLadar];
  if (scenario_.ladar == LadarKind::kNone) return;
  const auto silent = [this](Duration start) {
    return std::any_of(scenario_.ladar_outages.begin(), scenario_.ladar_outages.end(),
                       [&](const Outage& outage) { return outage.holds(seconds(start)); });
  };
  while (facet_start(s.count) < from_seconds(duration_s_) && silent(facet_start(s.count))) {
    ++s.count;
  }
  const std::int64_t scan_end = (s.count / facets() + 1) * facets();
  const bool whole_scan = facet_start(scan_end) <= from_seconds(duration_s_);
  s.due = whole_scan ? kStart + facet_start(s.count + 1) + kTransport : Stamp::max();
}

void Simulator::emit_ranges(SourceEvent* event) {
  Schedule& s = schedule_[kLadar];
  const ImagerParams& params = scenario_.imager;
  const std::int64_t number = s.count++;
  const std::int64_t scan = number / facets();
  const int facet = static_cast<int>(number % facets());
  const Duration start = facet_start(number);
  imager_.render(world_, vehicle(), seconds(start), facet, &facet_);

  const Duration clock_offset = from_seconds(scenario_.ladar_clock_offset_s);
  ladar_ranges_t m{};
  m.utime = to_utime(kStart + start + clock_offset);
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  m.scan_id = scan;
  m.reference_utime = to_utime(kStart + facet_start((scan + 1) * facets()) + clock_offset);
  m.facet = static_cast<std::int16_t>(facet);
  m.facet_count = static_cast<std::int16_t>(facets());
  m.rows = static_cast<std::int16_t>(params.rows);
  m.cols = static_cast<std::int16_t>(params.cols);
  m.first_row = static_cast<std::int16_t>(facet_.first_row);
  m.facet_rows = static_cast<std::int16_t>(facet_.rows);
  m.duration_us = static_cast<std::int32_t>((facet_start(number + 1) - start).count());
  m.tilt_rad = facet_.head.tilt_rad;
  m.tilt_rate_radps = facet_.head.tilt_rate_radps;
  m.n = static_cast<std::int32_t>(facet_.range_m.size());
  m.range_m = facet_.range_m;
  encode(channel::kLadarRanges, m, event);
  schedule_ladar();
}

void Simulator::emit_points(SourceEvent* event) {
  Schedule& s = schedule_[kLadar];
  const SpinningParams& params = scenario_.spinning;
  const std::int64_t number = s.count++;
  const std::int64_t scan = number / facets();
  const int sector = static_cast<int>(number % facets());
  const Duration start = facet_start(number);
  spinning_.render(world_, vehicle(), seconds(start), sector, &sector_);

  const Duration clock_offset = from_seconds(scenario_.ladar_clock_offset_s);
  ladar_points_t m{};
  m.utime = to_utime(kStart + start + clock_offset);
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  m.scan_id = scan;
  m.reference_utime = to_utime(kStart + facet_start((scan + 1) * facets()) + clock_offset);
  m.facet = static_cast<std::int16_t>(sector);
  m.facet_count = static_cast<std::int16_t>(facets());
  m.rows = static_cast<std::int16_t>(params.beams);
  m.cols = static_cast<std::int16_t>(params.cols);
  m.n = static_cast<std::int32_t>(sector_.x_m.size());
  m.x_m = sector_.x_m;
  m.y_m = sector_.y_m;
  m.z_m = sector_.z_m;
  m.n_index = m.n;
  m.row = sector_.row;
  m.col = sector_.col;
  m.n_time = m.n;
  m.dt_us = sector_.dt_us;
  encode(channel::kLadarPoints, m, event);
  schedule_ladar();
}

void Simulator::emit_truth(SourceEvent* event) {
  Schedule& s = schedule_[kTruth];
  const double time_s = static_cast<double>(++s.count) * kTruthInterval_s;
  const Motion motion = vehicle().at(time_s);
  truth_t m{};
  m.utime = to_utime(kStart + from_seconds(time_s));
  m.seq = s.seq;
  m.run_id = publisher_.run_id;
  m.publisher_id = publisher_.publisher_id;
  to_message(motion.T_world_vehicle, m.q_world_vehicle, m.p_world_vehicle_m);
  to_message(motion.v_world, m.v_world_mps);
  to_message(motion.rate_vehicle, m.rate_vehicle_radps);
  m.datum_lat_deg = degrees(scenario_.datum.lat_rad);
  m.datum_lon_deg = degrees(scenario_.datum.lon_rad);
  m.datum_height_m = scenario_.datum.height.m;
  const Clearance safety = clearance(world_, motion.T_world_vehicle, Footprint());
  m.clearance_m = safety.hard_m;
  m.foliage_contact = safety.foliage ? 1 : 0;
  encode(channel::kSimTruth, m, event);
  const Vec2 place_world = motion.T_world_vehicle.p.head<2>();
  const Vec3 ahead = motion.T_world_vehicle.q * Vec3::UnitX();
  actors_.observe({place_world, std::atan2(ahead.y(), ahead.x())}, motion.v_world.head<2>().norm(),
                  time_s);
  if (scenario_.commanded) count_contacts(motion, time_s);

  driven_m_ += (place_world - last_place_world_).norm();
  last_place_world_ = place_world;
  constexpr int kForgetEvery = 10;  // a tenth of a second
  if (s.count % kForgetEvery == 0) {
    world_.forget_beyond(place_world.x(), place_world.y(), scenario_.beam.max_range_m + 50.0);
  }
  schedule_periodic(kTruth, kTruthInterval_s, Duration(0));
}

void Simulator::count_contacts(const Motion& motion, double time_s) {
  const Pose& T_world_vehicle = motion.T_world_vehicle;
  const Vec3 ahead = T_world_vehicle.q * Vec3::UnitX();
  const CoursePoint at{T_world_vehicle.p.head<2>(), std::atan2(ahead.y(), ahead.x())};
  const Contact now = contact(world_, at, T_world_vehicle, scenario_.vehicle, Footprint(), {});
  contacts_.edge += now.edge && !touching_.edge ? 1 : 0;
  contacts_.body += now.body && !touching_.body ? 1 : 0;
  contacts_.tipped += now.tipped && !touching_.tipped ? 1 : 0;
  touching_ = now;
  actor_contacts_.observe(actors_, at, motion.v_world.head<2>().norm(), Footprint(), time_s);
}

Outcome simulate_to_log(const Scenario& scenario, LogWriter* log,
                        const std::function<void(double)>& progress) {
  Simulator simulator(scenario);
  const double whole_s = seconds(simulator.end() - Simulator::kStart);
  SourceEvent event;
  double next_report_s = 0.0;
  for (Stamp due = simulator.peek(); due != Stamp::max(); due = simulator.peek()) {
    simulator.take(&event);
    Outcome written = log->write(due, event.channel, event.data.data(), event.data.size());
    if (!written) return written;
    const double done_s = seconds(due - Simulator::kStart);
    if (done_s < next_report_s) continue;
    progress(std::min(1.0, done_s / whole_s));
    next_report_s += 0.01 * whole_s;
  }
  progress(1.0);
  return log->close();
}

}  // namespace rcs::sim
