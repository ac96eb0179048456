#include "tools/rcs/vehicle/up_report.h"

#include <unistd.h>

namespace rcs::cli {

UpReport::UpReport(Bus* bus, const std::string& config, std::int64_t config_hash, Stamp now)
    : events_(bus, "up", Duration::zero()), outbox_(bus, channel_of("up", "PROCESS")), next_(now) {
  message_.node = "up";
  message_.pid = getpid();
  message_.start_utime = to_utime(now);
  message_.config = config;
  message_.config_hash = config_hash;
}

bool UpReport::process(Stamp now, const std::string& note) {
  if (now < next_) return false;
  next_ = now + ProcessNode::kPeriod;
  message_.utime = to_utime(now);
  message_.note = note;
  usage_.read(&message_);
  outbox_.publish(&message_);
  return true;
}

}  // namespace rcs::cli
