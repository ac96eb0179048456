#pragma once
// A bus that ends in a log.

#include <string_view>

#include "rcs/node/bus/bus.h"
#include "rcs/node/log/log_file.h"

namespace rcs::recording {

/// Publishes straight into a log, at the time set last.
class LogBus final : public Bus {
 public:
  explicit LogBus(LogWriter* writer) : writer_(writer) {}
  void at(Stamp stamp) { stamp_ = stamp; }
  void subscribe(std::string_view /*channel*/, Receiver* /*receiver*/) override {}
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override {
    (void)writer_->write(stamp_, channel, data, size);  // the first failure stays: see close()
  }

 private:
  LogWriter* writer_;
  Stamp stamp_;
};

}  // namespace rcs::recording
