#pragma once
// A bus that writes to a log.

#include <string_view>

#include "rcs/node/bus/bus.h"
#include "rcs/node/log/log_file.h"

namespace rcs::recording {

/// Writes published messages to a log, with the time set last.
class LogBus final : public Bus {
 public:
  explicit LogBus(LogWriter* writer) : writer_(writer) {}
  void at(Stamp stamp) { stamp_ = stamp; }
  void subscribe(std::string_view /*channel*/, Receiver* /*receiver*/) override {}
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override {
    (void)writer_->write(stamp_, channel, data, size);  // close() returns the first failure
  }

 private:
  LogWriter* writer_;
  Stamp stamp_;
};

}  // namespace rcs::recording
