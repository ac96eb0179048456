#include "tools/rcs/vehicle/run_lock.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "rcs/node/bus/bus_exposure.h"
#include "rcs/node/bus/bus_url.h"

namespace rcs::cli {

std::string bus_name(const std::string& bus_url) {
  const BusAddress address = parse_bus_address(bus_url);
  return address.udp ? fmt::format("{}{}:{}", kUdp, address.group, address.port)
                     : bus_url.substr(0, bus_url.find('?'));
}

Result<RunLock> RunLock::take(const std::string& bus_url) {
  const std::string bus = bus_name(bus_url);
  FileHandle socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket.valid()) return Error{fmt::format("no socket: {}", std::strerror(errno))};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // A first byte of zero: an abstract name, which is in no folder.
  const std::string name = "rcs up " + bus;
  const std::size_t n = std::min(name.size(), sizeof(address.sun_path) - 1);
  std::memcpy(&address.sun_path[1], name.data(), n);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + n);
  if (bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0) {
    return RunLock(std::move(socket));
  }
  if (errno == EADDRINUSE) {
    return Error{fmt::format(
        "another `rcs up` runs on {}: stop it first (`rcs top` shows its process)", bus)};
  }
  return Error{fmt::format("cannot lock {}: {}", bus, std::strerror(errno))};
}

}  // namespace rcs::cli
