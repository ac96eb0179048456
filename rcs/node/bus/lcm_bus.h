#pragma once
// The live bus: LCM over UDP multicast on one computer. liblcm sends; UdpmReceiver receives,
// because the receiver of liblcm crashes on malformed fragments.

#include <lcm/lcm.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/udpm_receiver.h"

namespace rcs {

/// Buffers of 4 MB: with LCM's default size, messages of 300 kB are lost. ttl 0: packets stay on
/// this computer.
inline constexpr char kDefaultLcmUrl[] = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// Receives the messages of all channels. Called within LcmBus::deliver_one, on the same thread.
class BusMonitor {
 public:
  /// @param received_utime  wall clock of the receipt by this computer
  virtual void receive(std::string_view channel, const std::uint8_t* data, std::size_t size,
                       std::int64_t received_utime) noexcept = 0;

 protected:
  ~BusMonitor() = default;
};

class LcmBus final : public Bus {
 public:
  /// @param url  empty: the environment's LCM_DEFAULT_URL, else kDefaultLcmUrl
  /// The thread of its receiver handles no signal: they may be blocked (StopSignals) before or
  /// after it is created.
  static Result<std::unique_ptr<LcmBus>> create(const std::string& url);

  /// @param channel  a name, or a pattern as in matches()
  void subscribe(std::string_view channel, Receiver* receiver) override;
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override;
  /// `monitor` must outlive the last deliver_one().
  void subscribe_all(BusMonitor* monitor);

  /// Delivers one waiting message to its receivers. Its arrival is the moment at which this
  /// computer received it, not the moment at which the node read it: otherwise a lag of the node
  /// would be invisible.
  /// @param wall_utime  the wall clock at `now`, with which the kernel stamps datagrams; a step of
  ///                    that clock moves no arrival beyond `now` or before an earlier one. 0:
  ///                    unknown, all messages arrive now
  /// @return false if no message waits
  bool deliver_one(Stamp now, std::int64_t wall_utime = 0);

  [[nodiscard]] int fd() const { return receiver_->fd(); }  ///< readable when a message waits
  [[nodiscard]] const std::string& url() const { return url_; }
  /// An error if nothing can be received any more.
  [[nodiscard]] Outcome status() const;
  [[nodiscard]] std::int64_t publish_failures() const { return publish_failures_; }
  /// What arrived and was not delivered.
  [[nodiscard]] UdpmReceiver::Account receipts() const { return receiver_->account(); }

 private:
  struct Subscription {
    std::string channel;
    Receiver* receiver;
  };
  struct Destroy {
    void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  };

  LcmBus(lcm_t* lcm, std::unique_ptr<UdpmReceiver> receiver, std::string url)
      : url_(std::move(url)), lcm_(lcm), receiver_(std::move(receiver)) {}
  [[nodiscard]] bool test_reception();
  Stamp arrival(std::int64_t received_utime);

  std::string url_;
  std::vector<Subscription> subscriptions_;
  BusMonitor* monitor_ = nullptr;
  std::unique_ptr<lcm_t, Destroy> lcm_;  // sends only: without subscriptions it has no thread
  std::unique_ptr<UdpmReceiver> receiver_;
  UdpmReceiver::Message message_;  // reused
  std::string channel_;            // reused: LCM requires a terminated string
  Stamp now_;
  std::int64_t wall_utime_ = 0;
  Stamp last_arrival_ = Stamp::min();
  std::string failure_;
  std::int64_t publish_failures_ = 0;
};

}  // namespace rcs
