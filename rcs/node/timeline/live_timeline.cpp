#include "rcs/node/timeline/live_timeline.h"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "rcs/base/check.h"

namespace rcs {
namespace {

/// A refused descriptor is not a bug of this program: the process may have too many open.
FileHandle granted(int fd, const char* what) {
  if (fd < 0) throw std::system_error(errno, std::generic_category(), what);
  return FileHandle(fd);
}

void watch(int epoll, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  RCS_CHECK(epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) == 0);
}

}  // namespace

std::int64_t wall_utime() {
  timespec t{};
  RCS_CHECK(clock_gettime(CLOCK_REALTIME, &t) == 0);
  return std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
}

StopSignals::StopSignals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  RCS_CHECK(pthread_sigmask(SIG_BLOCK, &set, nullptr) == 0);
  fd_ = granted(signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK), "cannot open a signal descriptor");
}

LiveTimeline::LiveTimeline(LcmBus* bus, const StopSignals* stop)
    : bus_(bus),
      stop_(stop),
      epoll_(granted(epoll_create1(EPOLL_CLOEXEC), "cannot open an epoll descriptor")),
      timer_(granted(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK),
                     "cannot open a timer descriptor")) {
  watch(epoll_.get(), bus_->fd());
  watch(epoll_.get(), timer_.get());
  watch(epoll_.get(), stop_->fd());
}

Stamp LiveTimeline::now() const {
  timespec t{};
  RCS_CHECK(clock_gettime(CLOCK_MONOTONIC, &t) == 0);
  return from_utime(std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000);
}

void LiveTimeline::arm(Stamp until) {
  if (until == armed_) return;
  armed_ = until;
  itimerspec spec{};  // zero: off
  if (until != Stamp::max()) {
    // A timer value of zero would disable the timer; any past moment fires at once.
    const std::int64_t utime = std::max<std::int64_t>(to_utime(until), 1);
    spec.it_value.tv_sec = utime / 1'000'000;
    spec.it_value.tv_nsec = utime % 1'000'000 * 1000;
  }
  RCS_CHECK(timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &spec, nullptr) == 0);
}

Timeline::Step LiveTimeline::advance(Stamp until) {
  for (;;) {
    const bool due = now() >= until;
    if (!due) {
      arm(until);
      burst_ = 0;
    } else if (burst_ >= kMaxBurst) {
      burst_ = 0;
      return Step::kReached;
    }

    std::array<epoll_event, 3> events{};
    const int n =
        epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), due ? 0 : -1);
    RCS_CHECK(n >= 0 || errno == EINTR);
    bool message = false;
    for (int i = 0; i < n; ++i) {
      const int fd = events[static_cast<std::size_t>(i)].data.fd;
      if (fd == stop_->fd()) return Step::kEnded;
      if (fd == bus_->fd()) message = true;
    }
    if (message && bus_->deliver_one(now(), wall_utime())) {
      ++burst_;
      return Step::kDelivered;
    }
    if (!bus_->status()) return Step::kEnded;
    if (due) {
      burst_ = 0;
      return Step::kReached;
    }
  }
}

}  // namespace rcs
