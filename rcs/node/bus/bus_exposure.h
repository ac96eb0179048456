#pragma once
// Who else can reach the LCM bus. LCM's receiver trusts its network and listens on every interface
// of the computer, so this is told to whoever starts a node.

#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// An LCM address, as far as it matters here.
struct BusAddress {
  bool udp = false;  ///< udpm:// at all; the other kinds do not leave the computer
  std::string group = "239.255.76.67";
  int port = 7667;
  int ttl = 0;
};
[[nodiscard]] BusAddress parse_bus_address(std::string_view url);

/// The interface that a packet to `group` leaves by, "" when there is none: the longest prefix,
/// then the smallest metric.
/// @param table  content of /proc/net/route
[[nodiscard]] std::string route_interface(std::string_view table, std::string_view group);

/// What is wrong with the bus, in one line; "" when only this computer can reach it.
/// @param multicast_interface  route_interface()
/// @param interfaces           that are up and have an IPv4 address, lo left out
/// @param firewalled           somebody states that the port is dropped on all of them
[[nodiscard]] std::string reach_note(const BusAddress& address,
                                     std::string_view multicast_interface,
                                     const std::vector<std::string>& interfaces, bool firewalled);

/// The same of this computer as it is now.
[[nodiscard]] std::string reach_note(std::string_view url, bool firewalled);

}  // namespace rcs
