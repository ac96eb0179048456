#include "tools/recorder/recorder_report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "lcmtypes/events.h"

namespace rcs::recorder {
namespace {

constexpr Duration kMaxExposure = std::chrono::seconds(1);

double megabytes(std::int64_t bytes) { return static_cast<double>(bytes) * 1e-6; }

}  // namespace

RecorderReport::RecorderReport(Bus* bus, const RecorderParams& params, const std::string& folder,
                               Stamp now)
    : events_(bus, kNodeName, Duration::zero()),
      outbox_(bus, channel_of(kNodeName, "PROCESS")),
      reserve_mb_(megabytes(params.reserve_bytes)),
      next_(now),
      progress_(now) {
  message_.node = kNodeName;
  message_.pid = getpid();
  message_.start_utime = to_utime(now);
  message_.config = folder;
}

template <class... Args>
void RecorderReport::publish(Stamp now, const event::Info& event, fmt::format_string<Args...> text,
                             const Args&... args) {
  texts_.push_back(fmt::format(text, args...));
  events_.publish(now, event, "{}", texts_.back());
}

std::vector<std::string> RecorderReport::update(Stamp now, const RecorderThread::State& state) {
  next_ = now + kPeriod;
  if (state.cycles != cycles_) progress_ = now;
  cycles_ = state.cycles;
  exposure_ = std::max({exposure_, state.max_exposure, now - progress_});
  report_stop(now, state.recorder);
  if (now >= losses_due_) report_losses(now, state);
  message_.utime = to_utime(now);
  usage_.read(&message_);
  outbox_.publish(&message_);
  return std::exchange(texts_, {});
}

void RecorderReport::report_stop(Stamp now, const RecorderStatus& status) {
  const int before = std::exchange(stopped_by_, status.stopped_by);
  const std::int64_t lost = status.messages_lost - std::exchange(lost_, status.messages_lost);
  if (status.stopped_by == 0) {
    if (before == 0 && lost == 0) return;
    message_.note.clear();
    texts_.push_back(fmt::format("recording continues: {} messages were not recorded so far",
                                 status.messages_lost));
    events_.publish_end(now, event::kRecordStopped, "{}", texts_.back());
    return;
  }
  if (status.stopped_by == before) return;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the other thread does not call it
  const std::string reason = std::strerror(status.stopped_by);
  message_.note = is_disk_full(status.stopped_by)
                      ? fmt::format(
                            "recording stopped: disk full ({:.0f} MB free, reserve {:.0f} "
                            "MB) and nothing left to delete",
                            megabytes(status.free_bytes), reserve_mb_)
                      : fmt::format("recording stopped: {}", reason);
  publish(now, event::kRecordStopped, "{}; messages are not recorded", message_.note);
}

void RecorderReport::report_losses(Stamp now, const RecorderThread::State& state) {
  const RecorderStatus& status = state.recorder;
  RecorderThread::State& known = reported_;
  const std::size_t before = texts_.size();
  if (status.shed_for_space > known.recorder.shed_for_space) {
    publish(now, event::kRecordShed,
            "disk full: {} segments ({:.1f} MB) deleted, the oldest first; {:.0f} MB free, reserve "
            "{:.0f} MB; {} segments ({:.1f} MB) remain",
            status.shed_for_space - known.recorder.shed_for_space,
            megabytes(status.shed_for_space_bytes - known.recorder.shed_for_space_bytes),
            megabytes(status.free_bytes), reserve_mb_, status.segments,
            megabytes(status.segment_bytes));
  }
  if (state.queue.dropped > known.queue.dropped) {
    publish(now, event::kRecordDropped,
            "{} messages dropped: the disk is slower than the bus; {} dropped so far",
            state.queue.dropped - known.queue.dropped, state.queue.dropped);
  }
  if (state.queue.rejected > known.queue.rejected) {
    publish(now, event::kRecordRejected,
            "{} messages not recorded: channel name invalid, or more than 16 MB",
            state.queue.rejected - known.queue.rejected);
  }
  const auto audit_lost = [](const RecorderThread::State& s) {
    return s.recorder.audit_lines_lost + s.queue.audit_lines_dropped;
  };
  if (audit_lost(state) > audit_lost(known)) {
    publish(now, event::kRecordAudit, "{} lines of the audit log lost, {} wait for the disk",
            audit_lost(state) - audit_lost(known), status.audit_lines_waiting);
  }
  if (exposure_ > kMaxExposure) {
    publish(now, event::kRecordSlow,
            "storing took so long that a power failure would have cost {:.1f} s of the recording; "
            "limit {:.0f} s",
            seconds(exposure_), seconds(kMaxExposure));
    exposure_ = Duration::zero();
  }
  if (texts_.size() == before) return;
  known = state;
  losses_due_ = now + kLossInterval;
}

}  // namespace rcs::recorder
