#pragma once
// Checks of an LCM address, and advice for a bus that cannot be opened: liblcm accepts invalid
// addresses, or prints their faults in its own words.

#include <string>
#include <string_view>

#include "rcs/base/result.h"

namespace rcs {

inline constexpr std::string_view kUdp = "udpm://";

/// @return an error that names the invalid part of "udpm://ADDRESS:PORT?ttl=N&recv_buf_size=N"
[[nodiscard]] Outcome check_bus_url(std::string_view url);

/// The cause and the remedy for a valid address on which no bus can be opened.
/// @param multicast_interface  route_interface() of its address
[[nodiscard]] std::string bus_advice(std::string_view url, std::string_view multicast_interface);
/// The same for the present routes of this computer.
[[nodiscard]] std::string bus_advice(std::string_view url);

/// During its lifetime nothing reaches stderr, to which liblcm prints. For a process with one
/// thread.
class SilencedStderr {
 public:
  SilencedStderr();
  SilencedStderr(const SilencedStderr&) = delete;
  SilencedStderr& operator=(const SilencedStderr&) = delete;
  ~SilencedStderr();

 private:
  int before_;  // -1: not silenced
};

}  // namespace rcs
