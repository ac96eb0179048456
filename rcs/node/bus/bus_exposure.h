#pragma once
// Exposure of the LCM bus to other computers; each node reports it at its start. Nodes accept only
// datagrams of their own computer if ttl=0 (rcs/node/bus/udpm_receiver.h), but programs that
// receive with liblcm accept those of every interface.

#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// The parts of an LCM address that determine the exposure.
struct BusAddress {
  bool udp = false;  ///< udpm://; the other kinds do not leave the computer
  std::string group = "239.255.76.67";
  int port = 7667;
  int ttl = 0;
  int recv_buf_size = 0;  ///< bytes of the kernel's buffer; 0: its default
};
[[nodiscard]] BusAddress parse_bus_address(std::string_view url);

/// The interface of the route to `group`, "" if there is none: the longest prefix, then the
/// smallest metric.
/// @param table  content of /proc/net/route
[[nodiscard]] std::string route_interface(std::string_view table, std::string_view group);

/// A warning about the exposure of the bus, in one line; "" if only this computer can reach it.
/// @param multicast_interface  route_interface()
/// @param interfaces           interfaces that are up and have an IPv4 address, without lo
/// @param firewalled           the configuration states that the port is dropped on all of them
[[nodiscard]] std::string reach_note(const BusAddress& address,
                                     std::string_view multicast_interface,
                                     const std::vector<std::string>& interfaces, bool firewalled);

/// The same for the present state of this computer.
[[nodiscard]] std::string reach_note(std::string_view url, bool firewalled);

}  // namespace rcs
