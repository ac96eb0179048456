#include "rcs/node/bus/bus_url.h"

#include <gmock/gmock.h>

#include "rcs/node/bus/lcm_bus.h"

namespace rcs {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string fault_of(const char* url) {
  const Outcome valid = check_bus_url(url);
  return valid ? "" : valid.error().message;
}

TEST(BusUrl, AcceptsTheDefaultAndAddressesOfOtherGroups) {
  for (const char* url : {kDefaultLcmUrl, "udpm://", "udpm://?ttl=1", "udpm://224.0.0.1:1",
                          "udpm://239.1.2.3:7667"}) {
    EXPECT_EQ(fault_of(url), "") << url;
  }
}

TEST(BusUrl, NamesTheInvalidPartAndTheExpectedForm) {
  const std::pair<const char*, const char*> faults[] = {
      {"nonsense", "it has no scheme"},
      {"tcpq://localhost:7700", "the scheme tcpq is not supported"},
      {"udpm://300.1.2.3:7667", "\"300.1.2.3\" is not an IPv4 address"},
      {"udpm://10.0.0.1:7667?ttl=0", "10.0.0.1 is not a multicast address"},
      {"udpm://239.255.76.67", "no port"},
      {"udpm://239.255.76.67:99999", "port \"99999\" is not in [1, 65535]"},
      {"udpm://239.255.76.67:7667?ttl=256", "ttl \"256\" is not in [0, 255]"},
      {"udpm://239.255.76.67:7667?ttl=x", "ttl \"x\""},
      {"udpm://239.255.76.67:7667?tttl=1", "unknown option \"tttl\""},
      {"udpm://239.255.76.67:7667?ttl=0&recv_buf_size=-1", "recv_buf_size \"-1\""}};
  for (const auto& [url, fault] : faults) {
    EXPECT_THAT(fault_of(url), HasSubstr(fault)) << url;
    EXPECT_THAT(fault_of(url), HasSubstr(url));
    EXPECT_THAT(fault_of(url), HasSubstr("expected udpm://ADDRESS:PORT?ttl=0"));
  }
}

TEST(BusUrl, TheAdviceFollowsTheRoute) {
  const std::string no_route = bus_advice(kDefaultLcmUrl, "");
  EXPECT_THAT(no_route, HasSubstr("no route for UDP multicast to 239.255.76.67"));
  EXPECT_THAT(no_route, HasSubstr("ip route add 224.0.0.0/4 dev lo"));
  const std::string blocked = bus_advice(kDefaultLcmUrl, "eth0");
  EXPECT_THAT(blocked, Not(HasSubstr("ip route")));
  EXPECT_THAT(blocked, HasSubstr("ip link set eth0 up multicast on"));
  EXPECT_THAT(blocked, HasSubstr("UDP port 7667"));
}

}  // namespace
}  // namespace rcs
