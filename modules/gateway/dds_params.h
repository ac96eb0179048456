#pragma once
// Parameters of DDS.

#include <string>
#include <vector>

namespace rcs::gateway {

struct DdsParams {
  int domain = 0;                ///< DDS domain
  std::string interface = "lo";  ///< the only network interface that DDS uses
  bool multicast = false;        ///< discovery by multicast there; false: the peers below
  std::vector<std::string> peers = {"127.0.0.1"};  ///< hosts at which DDS looks for participants
  std::string keys;  ///< folder of an identity made by `rcs keys`; empty: unsecured
};

}  // namespace rcs::gateway
