#pragma once
// Receives the datagrams of an LCM bus. A thread empties the socket while the node computes,
// because the kernel's buffer is small (net.core.rmem_max); messages wait here until they are
// taken.

#include <netinet/in.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "rcs/node/bus/bus_exposure.h"
#include "rcs/node/bus/udpm_assembler.h"

namespace rcs {

/// @param pattern  a name; "*_EVENT": the names with this end; "*": all
[[nodiscard]] bool matches(std::string_view pattern, std::string_view channel);

class UdpmReceiver {
 public:
  static constexpr std::size_t kMaxMessages = 10'000;              ///< waiting
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;  ///< waiting

  struct Message {
    std::string channel;
    std::vector<std::uint8_t> data;
    std::int64_t received_utime = 0;  ///< wall clock of the receipt by the kernel
  };
  /// Datagrams and messages that were not delivered, so far.
  struct Account {
    std::int64_t malformed = 0;   ///< datagrams
    std::int64_t incomplete = 0;  ///< messages without all fragments
    std::int64_t foreign = 0;     ///< datagrams of other computers on a bus with ttl=0
    std::int64_t dropped = 0;     ///< messages, because too many wait
    std::int64_t lost = 0;        ///< datagrams, because the kernel's buffer was full
    [[nodiscard]] std::int64_t total() const {
      return malformed + incomplete + foreign + dropped + lost;
    }
  };

  /// Joins the multicast group. Errors name the call and its cause.
  /// The thread handles no signal.
  static Result<std::unique_ptr<UdpmReceiver>> open(const BusAddress& address);
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;
  ~UdpmReceiver();

  /// From now on, messages of the channels that match wait to be taken.
  void want(std::string_view pattern);
  void unwant(std::string_view pattern);

  /// @param message  replaced, and its memory used again
  /// @return false: none waits
  bool take(Message* message);
  [[nodiscard]] int fd() const { return ready_.get(); }  ///< readable when a message waits
  [[nodiscard]] Account account() const;
  /// Why nothing is received any more; empty: it is.
  [[nodiscard]] std::string failure() const;

 private:
  UdpmReceiver(FileHandle socket, FileHandle ready, FileHandle stop, bool only_local);
  void receive();
  bool receive_one();
  void put(const UdpmMessage& m, std::int64_t received_utime);
  [[nodiscard]] bool wanted(std::string_view channel) const;
  [[nodiscard]] bool is_local(const in_addr& address);

  FileHandle socket_;
  FileHandle ready_;  // eventfd: set while messages_ is not empty
  FileHandle stop_;   // eventfd: the thread is to end
  bool only_local_;

  // Of the thread.
  std::vector<std::uint8_t> buffer_;
  UdpmAssembler assembler_;
  std::uint32_t last_local_ = 0;  // address, network order
  bool local_known_ = false;

  mutable std::mutex mutex_;  // of the members below
  std::vector<std::string> wanted_;
  std::deque<Message> messages_;
  std::vector<Message> spare_;
  std::size_t bytes_ = 0;
  Account account_;
  std::string failure_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace rcs
