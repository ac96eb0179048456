#include "rcs/dds/network.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace rcs::dds {
namespace {

constexpr int kMaxDomain = 232;  // that of ROS 2; ports end at 65535

/// Characters of names of interfaces and hosts; they are copied into the configuration of DDS.
bool is_host_text(std::string_view text) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:";
  return !text.empty() && text.find_first_not_of(kAllowed) == std::string_view::npos;
}

}  // namespace

void read_network(ParamTable* table, Network* network, const char* domain_text) {
  table->get("domain", &network->domain, {0, kMaxDomain}, domain_text);
  table->get("interface", &network->interface, "Name of the one network interface that DDS uses.");
  table->get(
      "multicast", &network->multicast,
      "DDS discovery by multicast on that interface; false: peers are contacted one by one.");
  table->get("peers", &network->peers, "Hosts at which DDS looks for participants.");
  if (!is_host_text(network->interface)) {
    table->fail("interface", "must be the name of a network interface, e.g. \"lo\"");
  }
  if (!std::all_of(network->peers.begin(), network->peers.end(), is_host_text)) {
    table->fail("peers", "must be hosts, e.g. [\"127.0.0.1\", \"10.0.0.2\"]");
  }
}

std::string domain_xml(const Network& network, int max_processes, std::size_t max_sample_bytes) {
  std::string peers;
  for (const std::string& host : network.peers) {
    peers += fmt::format("<Peer Address=\"{}\"/>", host);
  }
  return fmt::format(
      "<CycloneDDS><Domain id=\"{}\">"
      "<General>"
      "<Interfaces><NetworkInterface name=\"{}\" multicast=\"{}\"/></Interfaces>"
      "<AllowMulticast>{}</AllowMulticast>"
      "</General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>"
      "<Peers>{}</Peers></Discovery>"
      "<Internal><MaxSampleSize>{} B</MaxSampleSize></Internal>"
      "</Domain></CycloneDDS>",
      network.domain, network.interface, network.multicast, network.multicast ? "spdp" : "false",
      max_processes, peers, max_sample_bytes);
}

}  // namespace rcs::dds
