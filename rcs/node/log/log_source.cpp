#include "rcs/node/log/log_source.h"

#include <algorithm>

namespace rcs {
namespace {

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

LogSource::LogSource(LogReader* reader, std::vector<std::string> channels)
    : reader_(reader), channels_(std::move(channels)) {
  read_ahead();
}

void LogSource::read_ahead() {
  while (reader_->next(&next_)) {
    if (!contains(channels_, next_.channel)) {
      ++passed_over_;
      continue;
    }
    due_ = next_.stamp + offset_;
    if (last_due_ != Stamp::min() &&
        (due_ > last_due_ + kMaxAhead || due_ < last_due_ - kMaxBack)) {
      ++clock_jumps_;
      offset_ += last_due_ - due_;
      due_ = last_due_;
    }
    last_due_ = due_;
    return;
  }
  due_ = Stamp::max();
}

void LogSource::take(SourceEvent* event) {
  std::swap(event->channel, next_.channel);
  std::swap(event->data, next_.data);
  ++fed_;
  read_ahead();
}

void LogRecorder::on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                             std::size_t size) {
  if (!contains(not_recorded_, channel)) (void)writer_->write(due, channel, data, size);
}

}  // namespace rcs
