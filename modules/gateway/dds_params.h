#pragma once
// What DDS is configured by.

#include <string>
#include <vector>

namespace rcs::gateway {

struct DdsParams {
  int domain = 0;                ///< DDS domain
  std::string interface = "lo";  ///< the one network interface that DDS may use
  bool multicast = false;        ///< discovery by multicast there; false: the peers below
  std::vector<std::string> peers = {"127.0.0.1"};  ///< hosts that are asked for participants
  std::string keys;  ///< folder of an identity made by `rcs keys`; empty: plain
};

}  // namespace rcs::gateway
