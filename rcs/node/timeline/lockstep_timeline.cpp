#include "rcs/node/timeline/lockstep_timeline.h"

#include <algorithm>

namespace rcs {

LockstepTimeline::LockstepTimeline(LocalBus* bus, EventSource* source, Duration tail)
    : bus_(bus), source_(source), tail_(tail) {
  const Stamp first = source_->peek();
  now_ = first == Stamp::max() ? Stamp() : first;
  end_ = now_ + tail_;
  bus_->set_publish_due(now_);
}

Timeline::Step LockstepTimeline::advance(Stamp until) {
  const Stamp outside = source_->peek();
  const Stamp inside = bus_->next_due();
  const Stamp next = std::min(outside, inside);
  until = std::max(until, now_);  // in the past: deliver what waits now

  if (outside == Stamp::max() && std::min(next, until) > end_) {
    while (bus_->next_due() != Stamp::max()) {
      move_to(bus_->next_due());
      bus_->deliver_next(now_);
    }
    return Step::kEnded;
  }
  if (next > until) {
    move_to(until);
    return Step::kReached;
  }
  if (inside <= outside) {
    move_to(inside);
    bus_->deliver_next(now_);
  } else {
    deliver_from_source(outside);
  }
  return Step::kDelivered;
}

void LockstepTimeline::deliver_from_source(Stamp due) {
  if (due < now_) ++stepped_back_;
  move_to(due);
  end_ = std::max(end_, now_ + tail_);
  source_->take(&event_);
  if (event_.channel.empty()) return;
  bus_->deliver(event_.channel, event_.data.data(), event_.data.size(), now_);
}

void LockstepTimeline::move_to(Stamp t) {
  now_ = std::max(now_, t);
  bus_->set_publish_due(now_);
}

void LockstepTimeline::begin_cycle(Duration nominal_compute) {
  busy_until_ = now_ + nominal_compute;
  bus_->set_publish_due(busy_until_);
}

Stamp LockstepTimeline::end_cycle() {
  bus_->set_publish_due(now_);
  return busy_until_;
}

}  // namespace rcs
