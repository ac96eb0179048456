#include "rcs/node/bus/bus_exposure.h"

#include <gtest/gtest.h>

namespace rcs {
namespace {

constexpr char kHeader[] =
    "Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\tWindow\tIRTT\n";
// In the format of the kernel: addresses in network order, printed as a number in host order.
constexpr char kDefault[] = "eth0\t00000000\t010200C0\t0003\t0\t0\t100\t00000000\t0\t0\t0\n";
constexpr char kWifi[] = "wlan0\t00000000\t010200C0\t0003\t0\t0\t50\t00000000\t0\t0\t0\n";
constexpr char kMulticastLo[] = "lo\t000000E0\t00000000\t0001\t0\t0\t0\t000000F0\t0\t0\t0\n";
constexpr char kDown[] = "lo\t000000E0\t00000000\t0000\t0\t0\t0\t000000F0\t0\t0\t0\n";
constexpr char kReject[] = "*\t000000E0\t00000000\t0200\t0\t0\t0\t000000F0\t0\t0\t0\n";

TEST(BusAddress, ParsesAddressesLikeLcm) {
  const BusAddress whole = parse_bus_address("udpm://239.1.2.3:1234?recv_buf_size=1&ttl=2");
  EXPECT_TRUE(whole.udp);
  EXPECT_EQ(whole.group, "239.1.2.3");
  EXPECT_EQ(whole.port, 1234);
  EXPECT_EQ(whole.ttl, 2);
  const BusAddress bare = parse_bus_address("udpm://?ttl=1");
  EXPECT_EQ(bare.group, "239.255.76.67");
  EXPECT_EQ(bare.port, 7667);
  EXPECT_EQ(bare.ttl, 1);
  EXPECT_EQ(parse_bus_address("udpm://").ttl, 0);
  EXPECT_FALSE(parse_bus_address("memq://").udp);
}

TEST(RouteInterface, TheLongestPrefixWinsThenTheSmallestMetric) {
  const std::string group = "239.255.76.67";
  const std::string header = kHeader;
  EXPECT_EQ(route_interface(header + kDefault + kMulticastLo, group), "lo");
  EXPECT_EQ(route_interface(header + kMulticastLo + kDefault, group), "lo");
  EXPECT_EQ(route_interface(header + kDefault + kWifi, group), "wlan0");
  EXPECT_EQ(route_interface(header + kWifi + kDefault, group), "wlan0");
  EXPECT_EQ(route_interface(header + kMulticastLo, "10.0.0.1"), "");
  EXPECT_EQ(route_interface(header + kDown + kDefault, group), "eth0");
  EXPECT_EQ(route_interface(header + kReject + kDefault, group), "eth0");
  EXPECT_EQ(route_interface(header, group), "");
  EXPECT_EQ(route_interface("", group), "");
  EXPECT_EQ(route_interface(header + "nonsense\n", group), "");
}

TEST(BusExposure, IsEmptyWhenOnlyThisComputerCanAccessTheBus) {
  const BusAddress bus = parse_bus_address("udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(reach_note(bus, "lo", {}, false), "");
  EXPECT_EQ(reach_note(bus, "lo", {"eth0"}, true), "");
  EXPECT_EQ(reach_note(parse_bus_address("memq://"), "eth0", {"eth0"}, false), "");
}

TEST(BusExposure, NamesTheInterfacesThePortAndTheRoute) {
  const BusAddress bus = parse_bus_address("udpm://239.255.76.67:7667?ttl=0");
  const std::string open = reach_note(bus, "lo", {"eth0", "wlan0"}, false);
  EXPECT_NE(open.find("reachable from eth0, wlan0"), std::string::npos) << open;
  EXPECT_NE(open.find("7667"), std::string::npos) << open;
  const std::string away = reach_note(bus, "eth0", {"eth0"}, true);
  EXPECT_NE(away.find("multicast is routed to eth0"), std::string::npos) << away;
  EXPECT_EQ(away.find("ttl"), std::string::npos) << away;
  const BusAddress far = parse_bus_address("udpm://239.255.76.67:7667?ttl=1");
  EXPECT_NE(reach_note(far, "eth0", {}, false).find("ttl 1"), std::string::npos);
}

}  // namespace
}  // namespace rcs
