// libFuzzer, compiled once for each message type (see CMakeLists.txt): the bytes are consecutive
// messages of that type without their fingerprints, which random input would rarely match. A
// decoder must neither crash nor allocate out of proportion; a decoded message must encode again;
// and the vehicle, which receives all of them, must continue to drive.

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "rcs/base/check.h"
#include "tests/fuzz/seeds.h"
#include "tests/replay/hostile_drive.h"
#include RCS_FUZZ_HEADER

namespace {

using Message = rcs::RCS_FUZZ_TYPE;
using rcs::test::Bytes;

constexpr std::size_t kFingerprint = 8;
constexpr std::size_t kMaxMessages = 8;

/// The first message of `data`; empty when it cannot be decoded.
Bytes take_message(const std::uint8_t* data, std::size_t size) {
  Bytes packet(kFingerprint + size);
  const auto fingerprint = static_cast<std::uint64_t>(Message::getHash());
  for (std::size_t i = 0; i < kFingerprint; ++i) {
    packet[i] = static_cast<std::uint8_t>(fingerprint >> (56 - 8 * i));
  }
  std::copy(data, data + size, packet.begin() + kFingerprint);
  Message message{};
  const int length = message.decode(packet.data(), 0, static_cast<int>(packet.size()));
  if (length < 0) return {};
  packet.resize(static_cast<std::size_t>(length));
  RCS_CHECK(rcs::test::encode(message).size() == packet.size());
  return packet;
}

/// The messages that the vehicle itself publishes on the channel.
class Received final : public rcs::BusTap {
 public:
  void on_deliver(rcs::Stamp /*due*/, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override {
    if (channel == RCS_FUZZ_CHANNEL) messages.emplace_back(data + kFingerprint, data + size);
  }
  std::vector<Bytes> messages;
};

std::vector<Bytes> seeds() {
  Received received;
  rcs::test::hostile_drive(RCS_FUZZ_CHANNEL, {}, &received);
  const Bytes zero = rcs::test::encode(Message{});
  received.messages.emplace_back(zero.begin() + kFingerprint, zero.end());
  return rcs::test::spoil(received.messages);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // An invalid message ends in the inbox; the tests verify that it is counted there.
  std::vector<Bytes> messages;
  while (size > 0 && messages.size() < kMaxMessages) {
    Bytes message = take_message(data, size);
    if (message.empty()) break;
    data += message.size() - kFingerprint;
    size -= message.size() - kFingerprint;
    messages.push_back(std::move(message));
  }
  if (!messages.empty()) rcs::test::hostile_drive(RCS_FUZZ_CHANNEL, messages, nullptr);
  return 0;
}
