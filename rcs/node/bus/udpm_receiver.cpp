#include "rcs/node/bus/udpm_receiver.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "rcs/node/process/worker_thread.h"

namespace rcs {
namespace {

constexpr std::size_t kLargestDatagram = 65'536;
constexpr std::size_t kMessageOverhead = 128;  // of a waiting message, beside its data
constexpr std::size_t kMaxSpare = 64;
constexpr std::size_t kLargestSpare = std::size_t{256} << 10;  // bytes

Error failed(const char* what) {
  return Error{fmt::format("{}: {}", what, std::generic_category().message(errno))};
}

bool set(int socket, int level, int option, int value) {
  return setsockopt(socket, level, option, &value, sizeof value) == 0;
}

void signal(int event_fd) {
  const std::uint64_t one = 1;
  (void)!write(event_fd, &one, sizeof one);
}

}  // namespace

bool matches(std::string_view pattern, std::string_view channel) {
  if (pattern.empty() || pattern[0] != '*') return pattern == channel;
  const std::string_view end = pattern.substr(1);
  return channel.size() >= end.size() && channel.substr(channel.size() - end.size()) == end;
}

Result<std::unique_ptr<UdpmReceiver>> UdpmReceiver::open(const BusAddress& address) {
  FileHandle socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  FileHandle ready(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  FileHandle stop(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!socket.valid() || !ready.valid() || !stop.valid()) return failed("cannot open a socket");
  // Several processes of a computer listen on one port.
  if (!set(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1)) return failed("SO_REUSEADDR");
  // The wish: the kernel limits it to net.core.rmem_max.
  if (address.recv_buf_size > 0) {
    (void)set(socket.get(), SOL_SOCKET, SO_RCVBUF, address.recv_buf_size);
  }
  (void)set(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, 1);
  if (!set(socket.get(), SOL_SOCKET, SO_TIMESTAMP, 1)) return failed("SO_TIMESTAMP");
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(static_cast<std::uint16_t>(address.port));
  if (inet_pton(AF_INET, address.group.c_str(), &name.sin_addr) != 1) {
    errno = EINVAL;
    return failed(address.group.c_str());
  }
  // Bound to the group, not to every address: a datagram to an address of this computer is not
  // received.
  if (bind(socket.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0) {
    return failed("bind");
  }
  const ip_mreq membership{name.sin_addr, {htonl(INADDR_ANY)}};
  if (setsockopt(socket.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) !=
      0) {
    return failed("IP_ADD_MEMBERSHIP");
  }
  return std::unique_ptr<UdpmReceiver>(
      new UdpmReceiver(std::move(socket), std::move(ready), std::move(stop), address.ttl == 0));
}

UdpmReceiver::UdpmReceiver(FileHandle socket, FileHandle ready, FileHandle stop, bool only_local)
    : socket_(std::move(socket)),
      ready_(std::move(ready)),
      stop_(std::move(stop)),
      only_local_(only_local),
      buffer_(kLargestDatagram),
      thread_(worker_thread([this] { receive(); })) {}

UdpmReceiver::~UdpmReceiver() {
  signal(stop_.get());
  thread_.join();
}

void UdpmReceiver::want(std::string_view pattern) {
  const std::lock_guard lock(mutex_);
  if (std::find(wanted_.begin(), wanted_.end(), pattern) == wanted_.end()) {
    wanted_.emplace_back(pattern);
  }
}

void UdpmReceiver::unwant(std::string_view pattern) {
  const std::lock_guard lock(mutex_);
  wanted_.erase(std::remove(wanted_.begin(), wanted_.end(), pattern), wanted_.end());
}

bool UdpmReceiver::wanted(std::string_view channel) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(wanted_.begin(), wanted_.end(),
                     [channel](const std::string& w) { return matches(w, channel); });
}

bool UdpmReceiver::take(Message* message) {
  const std::lock_guard lock(mutex_);
  if (messages_.empty()) return false;
  std::swap(*message, messages_.front());
  bytes_ -= message->data.size() + kMessageOverhead;
  Message& old = messages_.front();
  if (spare_.size() < kMaxSpare && old.data.capacity() <= kLargestSpare) {
    spare_.push_back(std::move(old));
  }
  messages_.pop_front();
  if (messages_.empty()) {
    std::uint64_t count = 0;
    (void)!read(ready_.get(), &count, sizeof count);
  }
  return true;
}

UdpmReceiver::Account UdpmReceiver::account() const {
  const std::lock_guard lock(mutex_);
  return account_;
}

std::string UdpmReceiver::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

void UdpmReceiver::receive() {
  std::array<pollfd, 2> watched{{{socket_.get(), POLLIN, 0}, {stop_.get(), POLLIN, 0}}};
  for (;;) {
    const int n = poll(watched.data(), watched.size(), -1);
    if (n < 0 && errno != EINTR) break;
    if (watched[1].revents != 0) return;
    while (receive_one()) {
    }
    if (!failure().empty()) break;
  }
  signal(ready_.get());  // wakes the node, which asks for the failure
}

/// @return false: no datagram waits, or the socket failed
bool UdpmReceiver::receive_one() {
  alignas(cmsghdr) std::array<char, 128> control{};
  sockaddr_in from{};
  iovec part{buffer_.data(), buffer_.size()};
  msghdr header{&from, sizeof from, &part, 1, control.data(), control.size(), 0};
  const ssize_t n = recvmsg(socket_.get(), &header, 0);
  if (n < 0) {
    if (errno == EINTR) return true;
    const bool waiting = errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOMEM ||
                         errno == ENOBUFS || errno == ENETDOWN;
    if (!waiting) {
      const std::string why = std::generic_category().message(errno);
      const std::lock_guard lock(mutex_);
      failure_ = why;
    }
    return false;
  }
  std::int64_t received_utime = 0;
  for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMP) {
      timeval t{};
      std::memcpy(&t, CMSG_DATA(c), sizeof t);
      received_utime = std::int64_t{t.tv_sec} * 1'000'000 + t.tv_usec;
    } else if (c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t lost = 0;
      std::memcpy(&lost, CMSG_DATA(c), sizeof lost);
      const std::lock_guard lock(mutex_);
      account_.lost = lost;
    }
  }
  if (only_local_ && !is_local(from.sin_addr)) {
    const std::lock_guard lock(mutex_);
    ++account_.foreign;
    return true;
  }
  const auto message = assembler_.add({from.sin_addr.s_addr, from.sin_port}, buffer_.data(),
                                      static_cast<std::size_t>(n),
                                      [this](std::string_view channel) { return wanted(channel); });
  if (message) put(*message, received_utime);
  const std::lock_guard lock(mutex_);
  account_.malformed = assembler_.account().malformed;
  account_.incomplete = assembler_.account().incomplete;
  return true;
}

void UdpmReceiver::put(const UdpmMessage& m, std::int64_t received_utime) {
  Message message;
  {
    const std::lock_guard lock(mutex_);
    if (messages_.size() >= kMaxMessages || bytes_ + m.size + kMessageOverhead > kMaxBytes) {
      ++account_.dropped;
      return;
    }
    if (!spare_.empty()) {
      message = std::move(spare_.back());
      spare_.pop_back();
    }
  }
  message.channel = m.channel;
  message.data.assign(m.data, m.data + m.size);
  message.received_utime = received_utime;
  const std::lock_guard lock(mutex_);
  bytes_ += m.size + kMessageOverhead;
  messages_.push_back(std::move(message));
  if (messages_.size() == 1) signal(ready_.get());
}

// Only a socket of this computer can have one of its addresses: the kernel drops datagrams that
// arrive from outside with such a source.
bool UdpmReceiver::is_local(const in_addr& address) {
  if (local_known_ && address.s_addr == last_local_) return true;
  const FileHandle probe(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr = address;
  const bool local = probe.valid() &&
                     bind(probe.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  if (!probe.valid()) return true;  // no descriptor is left: not a reason to be deaf
  local_known_ = local_known_ || local;
  if (local) last_local_ = address.s_addr;
  return local;
}

}  // namespace rcs
