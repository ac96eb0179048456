#pragma once
// The bus as a source: receives all channels and publishes nothing. While the clocks of the bus are
// unknown, nothing is passed.

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <memory>
#include <string>

#include "rcs/base/result.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/view/run_timeline.h"
#include "tools/view/source/live_clocks.h"
#include "tools/view/source/source.h"

namespace rcs::view {

class BusReception final : public Source, private BusMonitor {
 public:
  /// @param url  empty: the environment's LCM_DEFAULT_URL, else kDefaultLcmUrl
  /// @param stop  created before, so that the thread of the receiver inherits the mask
  static Result<std::unique_ptr<BusReception>> open(const std::string& url, const StopSignals* stop,
                                                    boost::asio::io_context* io,
                                                    RunTimeline* timeline);

  [[nodiscard]] bool live() const override { return true; }
  [[nodiscard]] std::string name() const override { return bus_->url(); }
  [[nodiscard]] ChannelSet channels() const override { return ~ChannelSet{0}; }
  [[nodiscard]] ros2::ClockOffsets clocks() const override { return clocks_.offsets(); }
  [[nodiscard]] Duration time() const override { return live_.now() - begin_; }
  [[nodiscard]] std::int64_t begin_utime() const override { return begin_utime_; }
  [[nodiscard]] Duration duration() const override { return time(); }
  [[nodiscard]] bool playing() const override { return true; }
  [[nodiscard]] double speed() const override { return 1.0; }
  void start(SourceSink* sink) override;

 private:
  BusReception(std::unique_ptr<LcmBus> bus, const StopSignals* stop, boost::asio::io_context* io,
               RunTimeline* timeline);
  void wait();
  void receive(std::string_view channel, const std::uint8_t* data, std::size_t size,
               std::int64_t received_utime) noexcept override;
  void pass(std::string_view channel, const std::uint8_t* data, std::size_t size,
            std::int64_t received_utime);

  std::unique_ptr<LcmBus> bus_;
  LiveTimeline live_;
  boost::asio::posix::stream_descriptor ready_;
  RunTimeline* timeline_;
  LiveClocks clocks_;
  Stamp begin_;
  std::int64_t begin_utime_;
  SourceSink* sink_ = nullptr;
  std::string failure_;
};

}  // namespace rcs::view
