#include "tools/recorder/record_queue.h"

#include <new>
#include <utility>

#include "rcs/node/log/log_file.h"

namespace rcs::recorder {
namespace {

/// More than the header of an event and the name of a channel.
constexpr std::size_t kEventOverhead = 128;

}  // namespace

void RecordQueue::push_message(Stamp stamp, std::string_view channel, const std::uint8_t* data,
                               std::size_t size) noexcept {
  const bool recordable = is_recordable(channel, size);
  bool half_full = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::int64_t number = counts_.received++;
    const std::size_t before = messages_.bytes.size();
    if (!recordable) {
      ++counts_.rejected;
    } else if (before + size + kEventOverhead > max_bytes_) {
      ++counts_.dropped;
    } else {
      try {
        if (messages_.empty()) messages_.stamp = stamp;
        append_event(number, stamp, channel, data, size, &messages_.bytes);
        messages_.ends.push_back(messages_.bytes.size());
      } catch (const std::bad_alloc&) {
        messages_.bytes.resize(before);
        ++counts_.dropped;
      }
    }
    half_full = messages_.bytes.size() > max_bytes_ / 2;
  }
  if (half_full) wake_.notify_one();
}

void RecordQueue::push_audit_line(Stamp stamp, std::string_view line) noexcept {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t before = audit_.bytes.size();
    if (before + line.size() >= kMaxAuditBytes) {
      ++counts_.audit_lines_dropped;
      return;
    }
    try {
      if (audit_.empty()) audit_.stamp = stamp;
      audit_.bytes.insert(audit_.bytes.end(), line.begin(), line.end());
      audit_.bytes.push_back('\n');
      audit_.ends.push_back(audit_.bytes.size());
    } catch (const std::bad_alloc&) {
      audit_.bytes.resize(before);
      ++counts_.audit_lines_dropped;
    }
  }
  wake_.notify_one();
}

void RecordQueue::count_lost_audit_line() noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++counts_.audit_lines_dropped;
}

void RecordQueue::wait(Duration time) {
  std::unique_lock<std::mutex> lock(mutex_);
  (void)wake_.wait_for(lock, time, [this] {
    return closed_ || !audit_.empty() || messages_.bytes.size() > max_bytes_ / 2;
  });
}

bool RecordQueue::take(Batch* messages, Batch* audit) {
  messages->clear();
  audit->clear();
  const std::lock_guard<std::mutex> lock(mutex_);
  std::swap(*messages, messages_);
  std::swap(*audit, audit_);
  return !closed_;
}

void RecordQueue::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
  }
  wake_.notify_one();
}

RecordQueue::Counts RecordQueue::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

}  // namespace rcs::recorder
