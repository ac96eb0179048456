#pragma once
// A section of a log as a source of events, with a progress bar and Ctrl-C.

#include <algorithm>
#include <string_view>

#include "rcs/node/log/log_file.h"
#include "rcs/node/log/log_source.h"
#include "tools/rcs/terminal.h"

namespace rcs::cli {

/// Ends early on Ctrl-C.
class PartOfLog final : public EventSource {
 public:
  /// @param command  label of the progress bar
  /// @param from, to  relative to the source's first event
  PartOfLog(std::string_view command, EventSource* source, Duration from, Duration to,
            const LogReader* reader)
      : source_(source), reader_(reader), progress_(command, Progress::kSteps) {
    const Stamp first = source_->peek();
    if (first == Stamp::max()) return;
    from_ = first + from;
    to_ = to < Stamp::max() - first ? first + to : Stamp::max();
    SourceEvent passed_over;
    while (source_->peek() < from_) source_->take(&passed_over);
  }

  [[nodiscard]] Stamp peek() override {
    const Stamp due = source_->peek();
    return due < to_ && !interrupt_.requested() ? due : Stamp::max();
  }
  void take(SourceEvent* event) override {
    // By time where the end is given, else by the size of the log.
    const double size = static_cast<double>(reader_->size_bytes());
    progress_.at_share(std::max(
        static_cast<double>(reader_->position_bytes()) / size,
        to_ == Stamp::max() ? 0.0 : seconds(source_->peek() - from_) / seconds(to_ - from_)));
    source_->take(event);
  }

  [[nodiscard]] bool interrupted() const { return interrupt_.requested(); }

 private:
  EventSource* source_;
  const LogReader* reader_;
  Stamp from_;
  Stamp to_ = Stamp::max();
  InterruptGuard interrupt_;
  Progress progress_;
};

}  // namespace rcs::cli
