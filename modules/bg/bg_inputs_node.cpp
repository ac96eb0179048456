#include "modules/bg/bg_inputs_node.h"

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"

namespace rcs::bg {
namespace {

constexpr Duration kSupervisorSilence = from_seconds(3.0);  // it publishes once a second
constexpr Duration kContested = from_seconds(1.0);          // after a message of a second publisher

}  // namespace

BgInputs::BgInputs(Bus* bus, bool supervised)
    : supervised_(supervised),
      nav_states_(bus, channel::kWmNavState, 8),
      integrities_(bus, channel::kWmIntegrity, 4),
      map_patches_(bus, channel::kWmMapPatch, 1),
      supervisor_(bus, channel::kUpProcess, 1) {
  if (bus->owners_required()) drives_.emplace(bus, channel::kBgDrive, 4);
}

std::vector<const InboxBase*> BgInputs::inboxes() const {
  std::vector<const InboxBase*> all = {&nav_states_, &integrities_, &map_patches_, &supervisor_};
  if (drives_) all.push_back(&*drives_);
  return all;
}

void BgInputs::take(Stamp now, Report* report) {
  if (supervisor_received_ == Stamp::min() || !supervisor_.empty()) supervisor_received_ = now;
  if (!supervisor_.empty()) supervisor_.pop();
  while (drives_ && !drives_->empty()) drives_->pop();
  for (; !integrities_.empty(); integrities_.pop()) {
    const integrity_t& m = *integrities_.front();
    if (read_integrity(m, integrities_.front_arrival(), &integrity_)) continue;
    report->publish(now, event::kBgInputRejected,
                    "{} rejected: protection levels {} m, {} m invalid", channel::kWmIntegrity,
                    m.protection_horizontal_m, m.protection_vertical_m);
  }
}

bool BgInputs::supervisor_silent(Stamp now) const {
  return supervised_ && now - supervisor_received_ > kSupervisorSilence;
}

bool BgInputs::second_publisher(Stamp now) const {
  return nav_states_.contested(now, kContested) || integrities_.contested(now, kContested) ||
         map_patches_.contested(now, kContested) ||
         (drives_ && drives_->contested(now, kContested));
}

}  // namespace rcs::bg
