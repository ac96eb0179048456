#include "rcs/node/bus/bus_exposure.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>

#include "rcs/node/bus/bus_url.h"

namespace rcs {
namespace {

constexpr unsigned kRouteUp = 0x0001;      // RTF_UP
constexpr unsigned kRouteReject = 0x0200;  // RTF_REJECT

void read_number(std::string_view text, int* value) {
  int v = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), v).ec == std::errc()) *value = v;
}

std::vector<std::string> open_interfaces() {
  std::vector<std::string> names;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return names;
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(all, freeifaddrs);
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
    const bool open = i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET &&
                      (i->ifa_flags & IFF_UP) != 0 && (i->ifa_flags & IFF_LOOPBACK) == 0;
    if (open && std::find(names.begin(), names.end(), i->ifa_name) == names.end()) {
      names.emplace_back(i->ifa_name);
    }
  }
  return names;
}

}  // namespace

BusAddress parse_bus_address(std::string_view url) {
  BusAddress address;
  address.udp = url.substr(0, kUdp.size()) == kUdp;
  if (!address.udp) return address;
  url.remove_prefix(kUdp.size());
  const std::size_t question = url.find('?');
  const std::string_view host = url.substr(0, question);
  const std::size_t colon = host.find(':');
  if (!host.substr(0, colon).empty()) address.group = host.substr(0, colon);
  if (colon != std::string_view::npos) read_number(host.substr(colon + 1), &address.port);
  constexpr std::string_view kTtl = "ttl=";
  constexpr std::string_view kBuffer = "recv_buf_size=";
  std::string_view options = question == std::string_view::npos ? "" : url.substr(question + 1);
  while (!options.empty()) {
    const std::size_t end = std::min(options.find('&'), options.size());
    const std::string_view option = options.substr(0, end);
    if (option.substr(0, kTtl.size()) == kTtl) {
      read_number(option.substr(kTtl.size()), &address.ttl);
    } else if (option.substr(0, kBuffer.size()) == kBuffer) {
      read_number(option.substr(kBuffer.size()), &address.recv_buf_size);
    }
    options.remove_prefix(std::min(end + 1, options.size()));
  }
  return address;
}

std::string route_interface(std::string_view table, std::string_view group) {
  in_addr wanted{};
  if (inet_pton(AF_INET, std::string(group).c_str(), &wanted) != 1) return "";
  std::istringstream lines{std::string(table)};
  std::string line;
  std::getline(lines, line);  // the header
  std::string best;
  std::uint32_t best_mask = 0;
  int best_metric = 0;
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string interface;
    std::string skipped;
    std::uint32_t destination = 0;  // these in network byte order
    std::uint32_t mask = 0;
    unsigned flags = 0;
    int metric = 0;
    fields >> interface >> std::hex >> destination >> skipped >> flags >> std::dec >> skipped >>
        skipped >> metric >> std::hex >> mask;
    if (!fields || (flags & kRouteUp) == 0 || (flags & kRouteReject) != 0) continue;
    if ((wanted.s_addr & mask) != destination) continue;
    const std::uint32_t prefix = ntohl(mask);
    if (best.empty() || prefix > best_mask || (prefix == best_mask && metric < best_metric)) {
      best = interface;
      best_mask = prefix;
      best_metric = metric;
    }
  }
  return best;
}

std::string reach_note(const BusAddress& address, std::string_view multicast_interface,
                       const std::vector<std::string>& interfaces, bool firewalled) {
  if (!address.udp) return "";
  std::string note;
  // liblcm binds to 0.0.0.0: a packet sent to any address of this computer reaches it,
  // independently of the multicast route. Firewall rules cannot be read without privileges.
  if (!interfaces.empty() && !firewalled) {
    std::string names;
    for (const std::string& name : interfaces) names += (names.empty() ? "" : ", ") + name;
    note = fmt::format(
        "bus reachable from {}: unless a firewall drops UDP port {} there, any host on these "
        "networks can {}; see docs/user/vehicle_install.md, Bus firewall",
        names, address.port,
        address.ttl > 0 ? "command the vehicle"
                        : "crash programs that receive with liblcm, such as a driver");
  }
  if (!multicast_interface.empty() && multicast_interface != "lo") {
    note += fmt::format(
        "{}multicast is routed to {}{}, not to lo; see docs/user/vehicle_install.md, Bus firewall",
        note.empty() ? "" : "; ", multicast_interface,
        address.ttl > 0 ? fmt::format(" with ttl {}, onto its network", address.ttl)
                        : std::string());
  }
  return note;
}

std::string reach_note(std::string_view url, bool firewalled) {
  const BusAddress address = parse_bus_address(url);
  std::ifstream file("/proc/net/route");
  const std::string table((std::istreambuf_iterator<char>(file)), {});
  return reach_note(address, route_interface(table, address.group), open_interfaces(), firewalled);
}

}  // namespace rcs
