#include "modules/ros2_bridge/input_node.h"

#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "rcs/cdr/cdr_message.h"
#include "rcs/ros2/sensor_input.h"

namespace rcs::ros2_bridge {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr std::string_view kMalformed = "malformed message";
constexpr std::string_view kValue = "a value is not finite or not plausible";

}  // namespace

Ros2ToBus::Ros2ToBus(const Ros2BridgeConfig& config, Bus* bus)
    : config_(config),
      points_out_(bus, channel::kLadarPoints),
      ins_out_(bus, channel::kIns),
      fix_out_(bus, channel::kGpsFix),
      odometry_out_(bus, channel::kOdometry) {
  add(config_.cloud, ros2::msg::PointCloud2::kName, 4, &Ros2ToBus::on_cloud, bus);
  add(config_.imu, ros2::msg::Imu::kName, 128, &Ros2ToBus::on_imu, bus);
  add(config_.fix, ros2::msg::NavSatFix::kName, 16, &Ros2ToBus::on_fix, bus);
  add(config_.odometry, ros2::msg::Odometry::kName, 64, &Ros2ToBus::on_odometry, bus);
}

void Ros2ToBus::add(const InputConfig& config, const char* type, int depth, Handler handler,
                    Bus* bus) {
  if (!config.on()) return;
  inputs_.push_back({&config, type, depth, handler, InputGate(config.max_rate_hz, config_.stamps),
                     Report(bus, config_.info.name, kReportInterval)});
}

std::vector<DdsInput> Ros2ToBus::inputs() const {
  std::vector<DdsInput> all;
  for (const Input& i : inputs_) all.push_back({i.config->topic, i.type, i.depth});
  return all;
}

void Ros2ToBus::receive(std::size_t input, const DdsSample& sample, std::int64_t utc_minus_node_us,
                        Stamp now) {
  current_ = &inputs_[input];
  utc_minus_node_us_ = utc_minus_node_us;
  now_ = now;
  const InputVerdict arrival = current_->gate.judge_arrival(sample.publisher, now);
  if (arrival == InputVerdict::kTooFast) {
    ++current_->counts.rejected;
    ++current_->counts.flood;
    current_->report.publish(
        now, event::kRos2BridgeInputFlood, "{}: rate above {} Hz, {} messages rejected so far",
        current_->config->topic, current_->config->max_rate_hz, current_->counts.flood);
    return;
  }
  if (arrival != InputVerdict::kAccepted) return reject(current_, name_of(arrival));
  if (sample.size > current_->config->max_bytes) {
    return reject(current_, "larger than max_kbytes");
  }
  const std::string_view reason = (this->*current_->handler)(sample);
  if (!reason.empty()) return reject(current_, reason);
  ++current_->counts.accepted;
}

void Ros2ToBus::reject(Input* input, std::string_view reason) {
  ++input->counts.rejected;
  input->report.publish(now_, event::kRos2BridgeInputRejected,
                        "{}: message rejected: {}; {} rejected and {} accepted so far",
                        input->config->topic, reason, input->counts.rejected,
                        input->counts.accepted);
}

std::string_view Ros2ToBus::admit(const DdsSample& sample, const ros2::msg::Time& stamp,
                                  const std::string& frame_id, std::int64_t* utime) {
  if (frame_id != current_->config->frame_id) return "another frame_id than configured";
  const std::optional<std::int64_t> utc_us = ros2::utc_of(stamp);
  if (!utc_us) return "invalid stamp";
  const std::int64_t present_us = to_utime(now_) + utc_minus_node_us_;
  const InputVerdict verdict =
      current_->gate.judge_stamp(sample.publisher, *utc_us, present_us, now_);
  if (verdict == InputVerdict::kRestarted) {
    current_->last_utime.reset();
    current_->report.publish(now_, event::kRos2BridgeInputRestarted,
                             "{}: stamps continue before the last accepted one; the source counts "
                             "as restarted",
                             current_->config->topic);
  } else if (verdict != InputVerdict::kAccepted) {
    return name_of(verdict);
  }
  *utime = *utc_us;
  if (config_.sensor_clock == SensorClock::kNode) *utime -= utc_minus_node_us_;
  return {};
}

std::optional<Duration> Ros2ToBus::since_last(std::int64_t utime) const {
  if (!current_->last_utime) return std::nullopt;
  return Duration(utime - *current_->last_utime);
}

// The content is checked before the stamp: an invalid message must not become the newest one.

std::string_view Ros2ToBus::on_cloud(const DdsSample& sample) {
  if (!cdr::read_message(sample.data, sample.size, &cloud_)) return kMalformed;
  const ros2::CloudFault fault = ros2::read_cloud(cloud_, config_.cloud_limits, &points_);
  if (fault != ros2::CloudFault::kNone) return name_of(fault);
  std::int64_t utime = 0;
  const std::string_view reason =
      admit(sample, cloud_.header.stamp, cloud_.header.frame_id, &utime);
  if (!reason.empty()) return reason;
  // Numbers of a bridge that is started again are larger than before: SP drops no scan as an old
  // one (for LADARs of up to 20 scans a second).
  constexpr std::int64_t kShortestScan_us = 50'000;
  if (!next_scan_) next_scan_ = (to_utime(now_) + utc_minus_node_us_) / kShortestScan_us;
  ros2::to_facets(points_, utime, (*next_scan_)++, static_cast<std::int16_t>(config_.sensor_id),
                  &facets_);
  for (ladar_points_t& facet : facets_) points_out_.publish(&facet);
  return {};
}

std::string_view Ros2ToBus::on_imu(const DdsSample& sample) {
  ros2::msg::Imu message;
  if (!cdr::read_message(sample.data, sample.size, &message)) return kMalformed;
  // Any interval: the content alone.
  if (!ros2::to_ins(message, 0, from_milliseconds(10.0), config_.q_vehicle_imu)) return kValue;
  std::int64_t utime = 0;
  const std::string_view reason =
      admit(sample, message.header.stamp, message.header.frame_id, &utime);
  if (!reason.empty()) return reason;
  const std::optional<Duration> interval = since_last(utime);
  current_->last_utime = utime;
  // The first one begins an interval, as does the first one after a gap, which WM bridges or
  // reports.
  if (!interval) return {};
  std::optional<ins_t> out = ros2::to_ins(message, utime, *interval, config_.q_vehicle_imu);
  if (out) ins_out_.publish(&*out);
  return {};
}

std::string_view Ros2ToBus::on_fix(const DdsSample& sample) {
  ros2::msg::NavSatFix message;
  if (!cdr::read_message(sample.data, sample.size, &message)) return kMalformed;
  std::optional<gps_fix_t> out = ros2::to_gps_fix(message, 0, config_.fix_sigma_m);
  if (!out) return kValue;
  const std::string_view reason =
      admit(sample, message.header.stamp, message.header.frame_id, &out->utime);
  if (!reason.empty()) return reason;
  fix_out_.publish(&*out);
  return {};
}

std::string_view Ros2ToBus::on_odometry(const DdsSample& sample) {
  ros2::msg::Odometry message;
  if (!cdr::read_message(sample.data, sample.size, &message)) return kMalformed;
  if (!ros2::to_odometry(message, 0, std::nullopt, config_.odometry_sigma_mps)) return kValue;
  std::int64_t utime = 0;
  const std::string_view reason =
      admit(sample, message.header.stamp, message.child_frame_id, &utime);
  if (!reason.empty()) return reason;
  std::optional<odometry_t> out =
      ros2::to_odometry(message, utime, since_last(utime), config_.odometry_sigma_mps);
  current_->last_utime = utime;
  if (out) odometry_out_.publish(&*out);
  return {};
}

}  // namespace rcs::ros2_bridge
