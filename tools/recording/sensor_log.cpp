#include "tools/recording/sensor_log.h"

#include <algorithm>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/outbox.h"
#include "tools/recording/log_bus.h"

namespace rcs::recording {
namespace {

struct Outboxes {
  explicit Outboxes(Bus* bus)
      : ins(bus, channel::kIns),
        fix(bus, channel::kGpsFix),
        odometry(bus, channel::kOdometry),
        truth(bus, channel::kSimTruth) {}

  void operator()(ins_t m) { ins.publish(&m); }
  void operator()(gps_fix_t m) { fix.publish(&m); }
  void operator()(odometry_t m) { odometry.publish(&m); }
  void operator()(truth_t m) { truth.publish(&m); }

  Outbox<ins_t> ins;
  Outbox<gps_fix_t> fix;
  Outbox<odometry_t> odometry;
  Outbox<truth_t> truth;
};

}  // namespace

Outcome SensorLog::write(const std::string& path) const {
  std::vector<const Event*> in_order;
  in_order.reserve(events_.size());
  for (const Event& e : events_) in_order.push_back(&e);
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const Event* a, const Event* b) { return a->arrival < b->arrival; });
  Result<LogWriter> writer = LogWriter::create(path);
  if (!writer) return writer.error();
  LogBus bus(&writer.value());
  const std::int64_t begin = in_order.empty() ? 0 : to_utime(in_order.front()->arrival);
  bus.set_publisher({id_of("import", begin), id_of("import")});
  Outboxes outboxes(&bus);
  for (const Event* e : in_order) {
    bus.at(e->arrival);
    std::visit(outboxes, e->message);
  }
  return writer->close();
}

}  // namespace rcs::recording
