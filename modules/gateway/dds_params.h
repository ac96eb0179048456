#pragma once
// Parameters of DDS.

#include <string>

#include "rcs/dds/network.h"

namespace rcs::gateway {

struct DdsParams {
  dds::Network network;
  std::string keys;  ///< folder of an identity made by `rcs keys`; empty: unsecured
};

}  // namespace rcs::gateway
