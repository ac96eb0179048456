#include "tools/recorder/recorder.h"

#include <cerrno>

namespace rcs::recorder {
namespace {

/// Calls of store(), of which there are four per second. A file system may free the space of a
/// deleted file later: without the pause more would be deleted until then.
constexpr int kSpacePause = 8;
/// Of a disk with errors.
constexpr int kRetryPause = 4;

}  // namespace

bool is_disk_full(int error) { return error == ENOSPC || error == EDQUOT; }

Recorder::Recorder(Folder* folder, const RecorderParams& params)
    : folder_(folder),
      params_(params),
      messages_(folder, params.messages),
      audit_(folder, params.audit) {}

int Recorder::open() {
  if (const int error = messages_.open(); error != 0) return error;
  if (const int error = audit_.open(); error != 0) return error;
  update_status();
  return 0;
}

void Recorder::store(const Batch& messages, const Batch& audit) {
  store_audit(audit);
  keep_reserve();
  store_messages(messages);
  update_status();
}

/// @return false: nothing is left to delete
bool Recorder::shed_for_space() {
  std::int64_t freed = 0;
  if (!messages_.can_shed() || messages_.shed_oldest(&freed) != 0) return false;
  ++status_.shed_for_space;
  status_.shed_for_space_bytes += freed;
  return true;
}

/// Deletes as much as is missing from the reserve; if that is everything but the newest segment,
/// the recording stops.
void Recorder::keep_reserve() {
  if (until_space_check_ > 0) {
    --until_space_check_;
    return;
  }
  std::int64_t missing = params_.reserve_bytes - folder_->free_bytes();
  // So much more that it does not stop again at once.
  if (is_disk_full(status_.stopped_by)) missing += params_.resume_bytes;
  const std::int64_t allowed = messages_.bytes() - missing;
  if (missing > 0) until_space_check_ = kSpacePause;
  while (missing > 0 && messages_.bytes() > allowed) {
    if (!shed_for_space()) return stop(ENOSPC);
  }
  if (is_disk_full(status_.stopped_by)) status_.stopped_by = 0;
}

/// The audit log is more important than the recording: the oldest messages make room for it. Lines
/// that fit nowhere wait.
void Recorder::store_audit(const Batch& audit) {
  Batch& waiting = waiting_audit_;
  if (waiting.empty()) waiting.stamp = audit.stamp;
  for (std::size_t k = 0; k < audit.ends.size(); ++k) {
    if (waiting.bytes.size() >= params_.max_waiting_audit_bytes) {
      status_.audit_lines_lost += static_cast<std::int64_t>(audit.ends.size() - k);
      break;
    }
    const auto first = audit.bytes.begin();
    waiting.bytes.insert(waiting.bytes.end(),
                         first + static_cast<std::ptrdiff_t>(audit.begin_of(k)),
                         first + static_cast<std::ptrdiff_t>(audit.ends[k]));
    waiting.ends.push_back(waiting.bytes.size());
  }
  if (waiting.empty()) return;
  int error = audit_.append(waiting, &waiting_at_);
  while (is_disk_full(error) && shed_for_space()) error = audit_.append(waiting, &waiting_at_);
  if (error == 0) error = audit_.sync();
  if (is_disk_full(error)) return;  // continued with the next batch
  if (error != 0) {
    audit_.abandon_segment();
    waiting_at_ = {};  // lines that are stored twice are better than a missing one
    return;
  }
  status_.audit_lines += static_cast<std::int64_t>(waiting.ends.size());
  waiting.clear();
  waiting_at_ = {};
}

void Recorder::store_messages(const Batch& messages) {
  BatchPosition at;
  if (status_.stopped_by != 0 && !is_disk_full(status_.stopped_by) && --until_retry_ <= 0) {
    status_.stopped_by = 0;
  }
  int error = status_.stopped_by;
  if (error == 0) {
    error = messages_.append(messages, &at);
    while (is_disk_full(error) && shed_for_space()) error = messages_.append(messages, &at);
    const int unsynced = error == 0 ? messages_.sync() : 0;
    if (unsynced != 0) at = {};  // whether they are on the disk is unknown
    if (error != 0 || unsynced != 0) stop(error != 0 ? error : unsynced);
  }
  status_.messages += static_cast<std::int64_t>(at.record);
  status_.bytes += static_cast<std::int64_t>(at.byte);
  status_.messages_lost += static_cast<std::int64_t>(messages.ends.size() - at.record);
}

/// The segment ends here, possibly inside an event: what follows later begins a new one.
void Recorder::stop(int error) {
  status_.stopped_by = error;
  until_retry_ = kRetryPause;
  messages_.abandon_segment();
}

void Recorder::update_status() {
  status_.audit_lines_waiting = static_cast<std::int64_t>(waiting_audit_.ends.size());
  status_.segments = static_cast<std::int64_t>(messages_.segments());
  status_.segment_bytes = messages_.bytes();
  status_.shed_by_limit = messages_.shed_by_limit();
  status_.free_bytes = folder_->free_bytes();
}

}  // namespace rcs::recorder
