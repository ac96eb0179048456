#pragma once
// Where a process uses DDS, and the configuration of Cyclone DDS for it. Without DDS, because tools
// also read the parameters.

#include <cstddef>
#include <string>
#include <vector>

#include "rcs/node/params/params.h"

namespace rcs::dds {

struct Network {
  int domain = 0;                ///< DDS domain
  std::string interface = "lo";  ///< the only network interface that DDS uses
  bool multicast = false;        ///< discovery by multicast there; false: the peers below
  std::vector<std::string> peers = {"127.0.0.1"};  ///< hosts at which DDS looks for participants
};

/// Reads domain, interface, multicast and peers.
/// @param domain_text  description of the domain, a literal
void read_network(ParamTable* table, Network* network, const char* domain_text);

/// The complete configuration of Cyclone DDS: the environment must not influence that of a vehicle.
/// @param max_processes     of one host that are found by discovery
/// @param max_sample_bytes  larger samples are not assembled and are lost unseen
[[nodiscard]] std::string domain_xml(const Network& network, int max_processes,
                                     std::size_t max_sample_bytes);

}  // namespace rcs::dds
