#include "rcs/node/bus/bus_url.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <optional>

#include "rcs/node/bus/bus_exposure.h"

namespace rcs {
namespace {

constexpr std::string_view kForm =
    "expected udpm://ADDRESS:PORT?ttl=0, e.g. "
    "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// The integer that is the whole text.
std::optional<std::int64_t> integer(std::string_view text) {
  std::int64_t v = 0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, v);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return v;
}

/// @return what is wrong; empty: nothing
std::string wrong_address(std::string_view host) {
  const std::size_t colon = host.find(':');
  const std::string address(host.substr(0, colon));
  in_addr group{};
  if (inet_pton(AF_INET, address.c_str(), &group) != 1) {
    return fmt::format("\"{}\" is not an IPv4 address", address);
  }
  if (!IN_MULTICAST(ntohl(group.s_addr))) {
    return address + " is not a multicast address (224.0.0.0 to 239.255.255.255)";
  }
  if (colon == std::string_view::npos) return "no port after the address";
  const std::string_view port = host.substr(colon + 1);
  const std::optional<std::int64_t> number = integer(port);
  if (!number || *number < 1 || *number > 65535) {
    return fmt::format("port \"{}\" is not in [1, 65535]", port);
  }
  return "";
}

std::string wrong_option(std::string_view option) {
  const std::size_t equals = std::min(option.find('='), option.size());
  const std::string_view key = option.substr(0, equals);
  const std::string_view value = option.substr(std::min(equals + 1, option.size()));
  const std::optional<std::int64_t> number = integer(value);
  if (key == "ttl") {
    return number && *number >= 0 && *number <= 255
               ? ""
               : fmt::format("ttl \"{}\" is not in [0, 255] (0: this computer only)", value);
  }
  if (key == "recv_buf_size") {
    return number && *number > 0 && *number <= INT32_MAX
               ? ""
               : fmt::format("recv_buf_size \"{}\" is not a number of bytes", value);
  }
  return fmt::format("unknown option \"{}\" (known: ttl, recv_buf_size)", key);
}

}  // namespace

Outcome check_bus_url(std::string_view url) {
  const auto invalid = [url](const std::string& why) {
    return Error{fmt::format("invalid LCM address {}: {}; {}", url, why, kForm)};
  };
  if (url.substr(0, kUdp.size()) != kUdp) {
    const std::size_t scheme = url.find("://");
    return invalid(scheme == std::string_view::npos
                       ? "it has no scheme"
                       : fmt::format("the scheme {} is not supported", url.substr(0, scheme)));
  }
  const std::string_view rest = url.substr(kUdp.size());
  const std::size_t question = std::min(rest.find('?'), rest.size());
  // Without an address liblcm uses its default, which is that of kDefaultLcmUrl.
  if (const std::string_view host = rest.substr(0, question); !host.empty()) {
    if (const std::string wrong = wrong_address(host); !wrong.empty()) return invalid(wrong);
  }
  std::string_view options = rest.substr(std::min(question + 1, rest.size()));
  while (!options.empty()) {
    const std::size_t end = std::min(options.find('&'), options.size());
    if (const std::string wrong = wrong_option(options.substr(0, end)); !wrong.empty()) {
      return invalid(wrong);
    }
    options.remove_prefix(std::min(end + 1, options.size()));
  }
  return Done{};
}

std::string bus_advice(std::string_view url, std::string_view multicast_interface) {
  const BusAddress address = parse_bus_address(url);
  if (multicast_interface.empty()) {
    return fmt::format(
        "cannot open the LCM bus {}: no route for UDP multicast to {}. On this computer only, as "
        "root:\n"
        "  ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo",
        url, address.group);
  }
  return fmt::format(
      "cannot open the LCM bus {}: a test message to {} over {} was not received. Check that {} is "
      "up with multicast (ip link set {} up multicast on) and that no firewall drops UDP port {} "
      "on it.",
      url, address.group, multicast_interface, multicast_interface, multicast_interface,
      address.port);
}

std::string bus_advice(std::string_view url) {
  std::ifstream routes("/proc/net/route");
  const std::string table((std::istreambuf_iterator<char>(routes)), {});
  return bus_advice(url, route_interface(table, parse_bus_address(url).group));
}

SilencedStderr::SilencedStderr() : before_(-1) {
  std::fflush(stderr);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  before_ = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (before_ >= 0) (void)dup2(nowhere, STDERR_FILENO);
  (void)close(nowhere);
}

SilencedStderr::~SilencedStderr() {
  if (before_ < 0) return;
  std::fflush(stderr);
  (void)dup2(before_, STDERR_FILENO);
  (void)close(before_);
}

}  // namespace rcs
