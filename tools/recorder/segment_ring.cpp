#include "tools/recorder/segment_ring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>

#include "rcs/base/check.h"
#include "rcs/node/time_text.h"

namespace rcs::recorder {
namespace {

constexpr std::size_t kDigits = 8;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string digits_of(const std::string& text) {
  std::string digits;
  std::copy_if(text.begin(), text.end(), std::back_inserter(digits), is_digit);
  return digits;
}

}  // namespace

/// 0: not a segment of this ring.
std::int64_t SegmentRing::number_of(const std::string& name) const {
  const std::string& prefix = params_.prefix;
  const std::string& suffix = params_.suffix;
  const std::size_t begin = prefix.size();
  if (name.size() < begin + kDigits + suffix.size() || name.compare(0, begin, prefix) != 0 ||
      name.compare(name.size() - suffix.size(), suffix.size(), suffix) != 0) {
    return 0;
  }
  const std::string digits = name.substr(begin, kDigits);
  return std::all_of(digits.begin(), digits.end(), is_digit) ? std::stoll(digits) : 0;
}

/// "rcs-00000017-20261126T183404Z.log"
std::string SegmentRing::name_of(std::int64_t number, Stamp stamp) const {
  const std::int64_t utime = to_utime(stamp);
  return fmt::format("{}{:0{}}-{}T{}Z{}", params_.prefix, number, kDigits,
                     digits_of(utc_date(utime)), digits_of(time_of_day(utime)).substr(0, 6),
                     params_.suffix);
}

int SegmentRing::open() {
  std::vector<FolderEntry> entries;
  if (const int error = folder_->list(&entries); error != 0) return error;
  for (const FolderEntry& entry : entries) {
    const std::int64_t number = number_of(entry.name);
    if (number == 0) continue;
    segments_.push_back({number, entry.name, entry.bytes});
    bytes_ += entry.bytes;
    next_number_ = std::max(next_number_, number + 1);
  }
  std::sort(segments_.begin(), segments_.end(),
            [](const Segment& a, const Segment& b) { return a.number < b.number; });
  return 0;
}

bool SegmentRing::segment_is_full(const Batch& batch, std::size_t record) const {
  const std::int64_t held = segments_.back().bytes;
  const auto next = static_cast<std::int64_t>(batch.ends[record] - batch.begin_of(record));
  return held > 0 &&
         (held + next > params_.segment_bytes || batch.stamp - begun_ >= params_.segment_duration);
}

int SegmentRing::begin_segment(Stamp stamp) {
  if (const int error = sync(); error != 0) return error;
  file_.reset();
  const std::string name = name_of(next_number_, stamp);
  if (const int error = folder_->create(name, &file_); error != 0) return error;
  segments_.push_back({next_number_++, name, 0});
  begun_ = stamp;
  unsynced_name_ = true;
  return 0;
}

/// The end of the records that fit in the segment; at least one.
std::size_t SegmentRing::fitting_end(const Batch& batch, std::size_t record) const {
  const auto left = static_cast<std::size_t>(
      std::max<std::int64_t>(0, params_.segment_bytes - segments_.back().bytes));
  const std::size_t limit = batch.begin_of(record) + left;
  std::size_t end = record + 1;
  while (end < batch.ends.size() && batch.ends[end] <= limit) ++end;
  return batch.ends[end - 1];
}

int SegmentRing::make_room(std::int64_t bytes) {
  while ((bytes_ + bytes > params_.max_bytes || segments_.size() > kMaxSegments) && can_shed()) {
    std::int64_t freed = 0;
    if (const int error = shed_oldest(&freed); error != 0) return error;
    ++shed_by_limit_;
  }
  return 0;
}

int SegmentRing::append(const Batch& batch, BatchPosition* at) {
  while (at->record < batch.ends.size()) {
    const bool whole = at->byte == batch.begin_of(at->record);
    RCS_CHECK(whole || file_ != nullptr);
    if (file_ == nullptr || (whole && segment_is_full(batch, at->record))) {
      if (const int error = begin_segment(batch.stamp); error != 0) return error;
    }
    const std::size_t end = fitting_end(batch, at->record);
    const int no_room = make_room(static_cast<std::int64_t>(end - at->byte));
    if (no_room != 0) return no_room;
    while (at->byte < end) {
      std::size_t written = 0;
      const int error = file_->append(&batch.bytes[at->byte], end - at->byte, &written);
      if (error != 0) return error;
      if (written == 0) return ENOSPC;
      unsynced_ = true;
      at->byte += written;
      segments_.back().bytes += static_cast<std::int64_t>(written);
      bytes_ += static_cast<std::int64_t>(written);
      while (at->record < batch.ends.size() && batch.ends[at->record] <= at->byte) ++at->record;
    }
  }
  return 0;
}

int SegmentRing::sync() {
  if (unsynced_) {
    if (const int error = file_->sync(); error != 0) return error;
    unsynced_ = false;
  }
  if (unsynced_name_) {
    if (const int error = folder_->sync(); error != 0) return error;
    unsynced_name_ = false;
  }
  return 0;
}

void SegmentRing::abandon_segment() {
  if (file_ != nullptr && segments_.back().bytes == 0 &&
      folder_->remove(segments_.back().name) == 0) {
    segments_.pop_back();
    unsynced_name_ = false;
  }
  file_.reset();
  unsynced_ = false;
}

int SegmentRing::shed_oldest(std::int64_t* freed) {
  RCS_CHECK(can_shed());
  const Segment& oldest = segments_.front();
  const int error = folder_->remove(oldest.name);
  if (error != 0 && error != ENOENT) return error;
  *freed = oldest.bytes;
  bytes_ -= oldest.bytes;
  segments_.pop_front();
  return 0;
}

}  // namespace rcs::recorder
