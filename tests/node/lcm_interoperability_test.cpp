// On a private bus (with_bus.sh): LcmBus and programs that use liblcm itself, and datagrams that no
// program should send.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <lcm/lcm.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <poll.h>
#include <sys/socket.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "rcs/base/file_handle.h"
#include "rcs/node/bus/lcm_bus.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Lcm = std::unique_ptr<lcm_t, void (*)(lcm_t*)>;

constexpr char kChannel[] = "SP_POINTS";
constexpr int kPatience_ms = 5000;
/// Around the limits of one datagram, of one fragment, and of the messages of this system.
constexpr std::size_t kSizes[] = {0,      1,      1400,   65'480,  65'490,  65'499,
                                  65'500, 65'520, 70'000, 131'000, 200'000, 1'000'000};

Bytes numbers(std::size_t n) {
  Bytes out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint8_t>(i * 31 + i / 251);
  return out;
}

struct Ear final : Receiver {
  void receive(const std::uint8_t* data, std::size_t size, Stamp /*arrival*/) noexcept override {
    received.emplace_back(data, data + size);
  }
  std::vector<Bytes> received;
};

std::unique_ptr<LcmBus> open_bus() {
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  EXPECT_TRUE(bus.ok()) << bus.error().message;
  return std::move(bus).value();
}
Lcm open_lcm() { return {lcm_create(kDefaultLcmUrl), lcm_destroy}; }

bool deliver(LcmBus* bus) {
  pollfd ready{bus->fd(), POLLIN, 0};
  return poll(&ready, 1, kPatience_ms) > 0 && bus->deliver_one(test::at_ms(1));
}

TEST(LcmInteroperability, MessagesOfLiblcmAreReceived) {
  const auto bus = open_bus();
  Ear ear;
  bus->subscribe(kChannel, &ear);
  const Lcm lcm = open_lcm();
  for (const std::size_t size : kSizes) {
    const Bytes sent = numbers(size);
    ASSERT_EQ(lcm_publish(lcm.get(), kChannel, sent.data(), static_cast<unsigned>(size)), 0);
    ASSERT_EQ(lcm_publish(lcm.get(), "OTHER", sent.data(), static_cast<unsigned>(size)), 0);
    ASSERT_TRUE(deliver(bus.get())) << size;
    ASSERT_EQ(ear.received.size(), 1U) << size;
    EXPECT_TRUE(ear.received.back() == sent) << size;
    ear.received.clear();
  }
  EXPECT_EQ(bus->receipts().total(), 0);
}

TEST(LcmInteroperability, LiblcmReceivesMessagesOfTheBus) {
  const Lcm lcm = open_lcm();
  Bytes received;
  lcm_subscribe(
      lcm.get(), kChannel,
      [](const lcm_recv_buf_t* m, const char* /*channel*/, void* out) {
        const auto* const data = static_cast<const std::uint8_t*>(m->data);
        static_cast<Bytes*>(out)->assign(data, data + m->data_size);
      },
      &received);
  const auto bus = open_bus();
  for (const std::size_t size : kSizes) {
    const Bytes sent = numbers(size);
    bus->publish(kChannel, sent.data(), sent.size());
    ASSERT_GT(lcm_handle_timeout(lcm.get(), kPatience_ms), 0) << size;
    EXPECT_TRUE(received == sent) << size;
  }
}

TEST(LcmInteroperability, APatternSelectsChannelsByTheirEnd) {
  EXPECT_TRUE(matches("*", "SP_EVENT"));
  EXPECT_TRUE(matches("*_EVENT", "SP_EVENT"));
  EXPECT_TRUE(matches("SP_EVENT", "SP_EVENT"));
  EXPECT_FALSE(matches("*_EVENT", "SP_EVENTS"));
  EXPECT_FALSE(matches("*_EVENT", "EVENT"));
  EXPECT_FALSE(matches("", "SP_EVENT"));
  const auto bus = open_bus();
  Ear events;
  Ear all_of_sp;
  bus->subscribe("*_EVENT", &events);
  bus->subscribe("SP_EVENT", &all_of_sp);
  const auto other = open_bus();
  for (const char* channel : {"SP_EVENT", "SP_POINTS", "WM_EVENT"}) {
    other->publish(channel, nullptr, 0);
  }
  ASSERT_TRUE(deliver(bus.get()));
  ASSERT_TRUE(deliver(bus.get()));
  EXPECT_EQ(events.received.size(), 2U);
  EXPECT_EQ(all_of_sp.received.size(), 1U);
}

/// Sends datagrams to the port of the bus.
class Hostile {
 public:
  Hostile() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(7667);
    to_.sin_addr.s_addr = inet_addr("239.255.76.67");
  }
  void send(const Bytes& datagram) const {
    EXPECT_EQ(sendto(socket_.get(), datagram.data(), datagram.size(), 0,
                     reinterpret_cast<const sockaddr*>(&to_), sizeof to_),
              static_cast<ssize_t>(datagram.size()));
  }
  /// From an address that is not of this computer. @return the system permits it
  [[nodiscard]] bool send_from(const char* address, const Bytes& payload) const {
    const FileHandle raw(::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_RAW));
    if (!raw.valid()) return false;
    Bytes packet(sizeof(iphdr) + sizeof(udphdr) + payload.size());
    iphdr ip{};
    ip.version = 4;
    ip.ihl = 5;
    ip.tot_len = htons(static_cast<std::uint16_t>(packet.size()));
    ip.ttl = 0;
    ip.protocol = IPPROTO_UDP;
    ip.saddr = inet_addr(address);
    ip.daddr = to_.sin_addr.s_addr;
    udphdr udp{};
    udp.source = htons(4000);
    udp.dest = to_.sin_port;
    udp.len = htons(static_cast<std::uint16_t>(sizeof udp + payload.size()));
    std::memcpy(packet.data(), &ip, sizeof ip);
    std::memcpy(packet.data() + sizeof ip, &udp, sizeof udp);
    std::memcpy(packet.data() + sizeof ip + sizeof udp, payload.data(), payload.size());
    return sendto(raw.get(), packet.data(), packet.size(), 0,
                  reinterpret_cast<const sockaddr*>(&to_), sizeof to_) > 0;
  }

 private:
  FileHandle socket_;
  sockaddr_in to_{};
};

Bytes whole_message(char content) {
  return {0x4c,
          0x43,
          0x30,
          0x32,
          0,
          0,
          0,
          1,
          'S',
          'P',
          '_',
          'P',
          'O',
          'I',
          'N',
          'T',
          'S',
          0,
          static_cast<std::uint8_t>(content)};
}

/// LC03 with any fields.
Bytes fragment(std::mt19937* random) {
  Bytes d(20 + (*random)() % 64);
  for (std::uint8_t& b : d) b = static_cast<std::uint8_t>((*random)() % 256);
  const std::uint8_t magic[] = {0x4c, 0x43, 0x30, 0x33};
  std::copy(std::begin(magic), std::end(magic), d.begin());
  // Mostly plausible sizes, numbers and counts.
  if ((*random)() % 4 != 0) std::fill(d.begin() + 8, d.begin() + 19, std::uint8_t{0});
  if (d.size() > 30 && (*random)() % 2 == 0) std::memcpy(d.data() + 20, kChannel, sizeof kChannel);
  return d;
}

TEST(LcmInteroperability, MalformedFragmentsAreCountedAndTheBusContinues) {
  const auto bus = open_bus();
  Ear ear;
  bus->subscribe(kChannel, &ear);
  const Hostile hostile;
  std::mt19937 random(3);
  for (int k = 0; k < 20'000; ++k) {
    hostile.send(fragment(&random));
    if (k % 1000 != 0) continue;
    hostile.send(whole_message('a'));
    do {
      ASSERT_TRUE(deliver(bus.get())) << k << ": " << bus->status().error().message;
    } while (ear.received.back() != Bytes{'a'});
    ear.received.clear();
  }
  EXPECT_GT(bus->receipts().malformed, 5000);
  EXPECT_TRUE(bus->status().ok());
}

TEST(LcmInteroperability, DatagramsOfOtherComputersAreRejectedOnABusOfThisComputer) {
  const auto bus = open_bus();
  Ear ear;
  bus->subscribe(kChannel, &ear);
  const Hostile hostile;
  if (!hostile.send_from("192.0.2.7", whole_message('x'))) {
    GTEST_SKIP() << "no raw sockets here: NOT TESTED";
  }
  hostile.send(whole_message('a'));
  ASSERT_TRUE(deliver(bus.get()));
  ASSERT_EQ(ear.received.size(), 1U);
  EXPECT_EQ(ear.received[0], Bytes{'a'});
  EXPECT_EQ(bus->receipts().foreign, 1);
}

TEST(LcmInteroperability, ADatagramToTheAddressOfTheComputerIsNotReceived) {
  const auto bus = open_bus();
  Ear ear;
  bus->subscribe(kChannel, &ear);
  const FileHandle socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(7667);
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const Bytes datagram = whole_message('x');
  (void)sendto(socket.get(), datagram.data(), datagram.size(), 0,
               reinterpret_cast<const sockaddr*>(&here), sizeof here);
  Hostile().send(whole_message('a'));
  ASSERT_TRUE(deliver(bus.get()));
  ASSERT_EQ(ear.received.size(), 1U);
  EXPECT_EQ(ear.received[0], Bytes{'a'});
}

TEST(LcmInteroperability, AFloodWhileTheNodeIsStoppedTakesBoundedMemoryAndIsCounted) {
  const auto bus = open_bus();
  Ear ear;
  bus->subscribe(kChannel, &ear);
  const Bytes message = numbers(10);
  const int flood = static_cast<int>(UdpmReceiver::kMaxMessages) + 2000;
  for (int k = 0; k < flood; ++k) bus->publish(kChannel, message.data(), message.size());
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // the receiver empties the socket
  pollfd ready{bus->fd(), POLLIN, 0};
  int delivered = 0;
  while (poll(&ready, 1, 200) > 0 && bus->deliver_one(test::at_ms(1))) ++delivered;
  const UdpmReceiver::Account account = bus->receipts();
  EXPECT_LE(delivered, static_cast<int>(UdpmReceiver::kMaxMessages));
  EXPECT_EQ(delivered + account.dropped + account.lost, flood);
  bus->publish(kChannel, message.data(), message.size());
  EXPECT_TRUE(deliver(bus.get()));
}

}  // namespace
}  // namespace rcs
