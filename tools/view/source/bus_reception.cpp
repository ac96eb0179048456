#include "tools/view/source/bus_reception.h"

#include <unistd.h>

#include <exception>
#include <utility>
#include <vector>

#include "tools/recording/message_fields.h"

namespace rcs::view {
namespace {

/// Messages in a row before clients are served.
constexpr int kMaxBurst = 200;

}  // namespace

Result<std::unique_ptr<BusReception>> BusReception::open(const std::string& url,
                                                         const StopSignals* stop,
                                                         boost::asio::io_context* io,
                                                         RunTimeline* timeline) {
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(url);
  if (!bus) return bus.error();
  return std::unique_ptr<BusReception>(
      new BusReception(std::move(bus).value(), stop, io, timeline));
}

BusReception::BusReception(std::unique_ptr<LcmBus> bus, const StopSignals* stop,
                           boost::asio::io_context* io, RunTimeline* timeline)
    : bus_(std::move(bus)),
      live_(bus_.get(), stop),
      ready_(*io, dup(bus_->fd())),
      timeline_(timeline),
      begin_(live_.now()),
      begin_utime_(wall_utime()) {}

void BusReception::start(SourceSink* sink) {
  sink_ = sink;
  bus_->subscribe_all(this);
  wait();
}

void BusReception::wait() {
  ready_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                    [this](const boost::system::error_code& error) {
                      if (error) return;
                      for (int i = 0; i < kMaxBurst && bus_->deliver_one(live_.now()); ++i) {
                      }
                      if (const Outcome status = bus_->status(); !status) {
                        sink_->on_failure(status.error().message);
                      } else if (!failure_.empty()) {
                        sink_->on_failure(failure_);
                      } else {
                        wait();
                      }
                    });
}

void BusReception::receive(std::string_view channel, const std::uint8_t* data, std::size_t size,
                           std::int64_t received_utime) noexcept {
  try {
    pass(channel, data, size, received_utime);
  } catch (const std::exception& e) {
    failure_ = e.what();  // out of memory
  }
}

void BusReception::pass(std::string_view channel, const std::uint8_t* data, std::size_t size,
                        std::int64_t received_utime) {
  const Stamp now = live_.now();
  const auto head = recording::read_head(channel, data, size);
  if (head && clocks_.add(channel, head->utime, from_utime(received_utime), now)) sink_->on_jump();
  timeline_->add(channel, data, size, now - begin_);
  if (clocks_.known()) sink_->on_message({channel, data, size, now - begin_, received_utime});
}

}  // namespace rcs::view
