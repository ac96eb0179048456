#include "rcs/node/bus/udpm_assembler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace rcs {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr UdpmSender kAlice{1, 1000};
constexpr UdpmSender kBob{1, 1001};

void append(Bytes* out, std::uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) {
    out->push_back(static_cast<std::uint8_t>(value >> (8U * static_cast<unsigned>(i))));
  }
}
void append(Bytes* out, const std::string& text) {
  out->insert(out->end(), text.begin(), text.end());
  out->push_back(0);
}

Bytes whole(const std::string& channel, const Bytes& data) {
  Bytes out;
  append(&out, 0x4c433032, 4);
  append(&out, 7, 4);
  append(&out, channel);
  out.insert(out.end(), data.begin(), data.end());
  return out;
}

struct Fragment {
  std::uint32_t sequence = 7;
  std::uint32_t size = 0;  ///< of the message
  std::uint32_t offset = 0;
  std::uint16_t number = 0;
  std::uint16_t count = 0;
  std::string channel;  ///< of the first
  Bytes data;
};
Bytes encode(const Fragment& f) {
  Bytes out;
  append(&out, 0x4c433033, 4);
  append(&out, f.sequence, 4);
  append(&out, f.size, 4);
  append(&out, f.offset, 4);
  append(&out, f.number, 2);
  append(&out, f.count, 2);
  if (f.number == 0) append(&out, f.channel);
  out.insert(out.end(), f.data.begin(), f.data.end());
  return out;
}

Bytes numbers(std::size_t n) {
  Bytes out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint8_t>(i * 31 + i / 251);
  return out;
}

/// A message in fragments of at most `most` bytes.
std::vector<Bytes> fragments_of(const Bytes& data, std::size_t most, std::uint32_t sequence = 7) {
  std::vector<Bytes> out;
  const std::size_t count = (data.size() + most - 1) / most;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t begin = k * most;
    const std::size_t end = std::min(begin + most, data.size());
    out.push_back(encode({sequence, static_cast<std::uint32_t>(data.size()),
                          static_cast<std::uint32_t>(begin), static_cast<std::uint16_t>(k),
                          static_cast<std::uint16_t>(count), "SP_POINTS",
                          Bytes(data.begin() + static_cast<std::ptrdiff_t>(begin),
                                data.begin() + static_cast<std::ptrdiff_t>(end))}));
  }
  return out;
}

class Assembler : public testing::Test {
 protected:
  /// @return "CHANNEL:size" of a message; empty: none
  std::string add(const UdpmSender& from, const Bytes& datagram) {
    // In a buffer of its own: asan finds a read beyond its end.
    const Bytes copy(datagram.begin(), datagram.end());
    const auto m = assembler_.add(from, copy.data(), copy.size(),
                                  [this](std::string_view c) { return c != unwanted_; });
    if (!m) return "";
    data_.assign(m->data, m->data + m->size);
    return std::string(m->channel) + ":" + std::to_string(m->size);
  }
  std::string unwanted_ = "-";
  UdpmAssembler assembler_;
  Bytes data_;
};

TEST_F(Assembler, AWholeMessage) {
  EXPECT_EQ(add(kAlice, whole("INS", numbers(100))), "INS:100");
  EXPECT_EQ(data_, numbers(100));
  EXPECT_EQ(add(kAlice, whole("INS", {})), "INS:0");
  EXPECT_EQ(add(kAlice, whole(std::string(63, 'X'), {})), std::string(63, 'X') + ":0");
  unwanted_ = "INS";
  EXPECT_EQ(add(kAlice, whole("INS", numbers(100))), "");
  EXPECT_EQ(assembler_.account().malformed, 0);
}

TEST_F(Assembler, FragmentsOfTwoSendersAtOnce) {
  const std::vector<Bytes> alice = fragments_of(numbers(200'000), 60'000);
  const std::vector<Bytes> bob = fragments_of(numbers(100'000), 60'000);
  ASSERT_EQ(alice.size(), 4U);
  EXPECT_EQ(add(kAlice, alice[0]), "");
  EXPECT_EQ(add(kBob, bob[0]), "");
  EXPECT_EQ(add(kAlice, alice[1]), "");
  EXPECT_EQ(add(kBob, bob[1]), "SP_POINTS:100000");
  EXPECT_EQ(data_, numbers(100'000));
  EXPECT_EQ(add(kAlice, alice[2]), "");
  EXPECT_EQ(add(kAlice, alice[3]), "SP_POINTS:200000");
  EXPECT_EQ(data_, numbers(200'000));
  EXPECT_EQ(assembler_.account().incomplete, 0);
  EXPECT_EQ(assembler_.account().malformed, 0);
}

TEST_F(Assembler, AMessageWithoutAFragmentIsIncompleteAndTheNextOneIsReceived) {
  const std::vector<Bytes> first = fragments_of(numbers(200'000), 60'000, 1);
  const std::vector<Bytes> second = fragments_of(numbers(200'000), 60'000, 2);
  for (const std::size_t k : {0U, 1U, 3U}) EXPECT_EQ(add(kAlice, first[k]), "");
  EXPECT_EQ(assembler_.account().incomplete, 1);
  EXPECT_EQ(add(kAlice, first[2]), "");
  std::string last;
  for (const Bytes& f : second) last = add(kAlice, f);
  EXPECT_EQ(last, "SP_POINTS:200000");
  // The beginning of the next message ends the one before.
  EXPECT_EQ(add(kAlice, first[0]), "");
  for (const Bytes& f : second) last = add(kAlice, f);
  EXPECT_EQ(last, "SP_POINTS:200000");
  EXPECT_EQ(assembler_.account().incomplete, 2);
  EXPECT_EQ(assembler_.account().malformed, 0);
}

TEST_F(Assembler, MalformedDatagramsAreCounted) {
  const std::uint32_t most = UdpmAssembler::kMaxMessage;
  const Bytes some = numbers(10);
  const std::vector<Bytes> malformed = {
      {},
      {0x4c, 0x43, 0x30, 0x32, 0, 0, 0},          // shorter than its header
      numbers(100),                               // another protocol
      whole("", some),                            // no channel
      whole(std::string(64, 'X'), some),          // a channel that is too long
      {0x4c, 0x43, 0x30, 0x32, 0, 0, 0, 1, 'I'},  // a channel without end
      encode({7, 100, 0, 3, 3, "INS", some}),     // the fourth of three
      encode({7, 100, 0, 0, 0, "INS", some}),     // of no fragments
      encode({7, 5, 0, 0, 2, "INS", some}),       // larger than its message
      encode({7, 100, 5, 0, 2, "INS", some}),     // begins after the beginning
      encode({7, 100, 0xffffffff, 1, 2, "INS", some}),
      encode({7, 0xffffffff, 0xfffffff8, 1, 2, "INS", some}),
      encode({7, most + 1, 0, 0, 2, "INS", some}),
      encode({7, 100, 0, 0, 2, std::string(64, 'X'), some}),
  };
  for (std::size_t k = 0; k < malformed.size(); ++k) {
    EXPECT_EQ(add(kAlice, malformed[k]), "") << k;
    EXPECT_EQ(assembler_.account().malformed, static_cast<std::int64_t>(k) + 1) << k;
  }
}

TEST_F(Assembler, FragmentsThatContradictTheFirstOneEndTheMessage) {
  const Bytes some = numbers(10);
  const Bytes first = encode({7, 100, 0, 0, 3, "INS", some});
  const std::vector<Bytes> contradicting = {
      encode({7, 101, 10, 1, 3, "", some}), encode({7, 100, 10, 1, 4, "", some}),
      encode({7, 100, 9, 1, 3, "", some}), encode({7, 100, 11, 1, 3, "", some}),
      encode({7, 100, 10, 2, 3, "", some})};
  for (const Bytes& second : contradicting) {
    const std::int64_t before = assembler_.account().incomplete;
    EXPECT_EQ(add(kAlice, first), "");
    EXPECT_EQ(add(kAlice, second), "");
    EXPECT_EQ(assembler_.account().incomplete, before + 1);
  }
  // The last fragment ends before the message.
  EXPECT_EQ(add(kAlice, encode({7, 100, 0, 0, 2, "INS", some})), "");
  EXPECT_EQ(add(kAlice, encode({7, 100, 10, 1, 2, "", some})), "");
  EXPECT_EQ(assembler_.account().malformed, 1);
}

TEST_F(Assembler, FragmentsOfUnwantedChannelsAndUnknownBeginningsTakeNoMemory) {
  unwanted_ = "SP_POINTS";
  for (const Bytes& f : fragments_of(numbers(200'000), 60'000)) EXPECT_EQ(add(kAlice, f), "");
  unwanted_ = "-";
  EXPECT_EQ(add(kAlice, fragments_of(numbers(200'000), 60'000)[1]), "");
  EXPECT_EQ(assembler_.account().incomplete, 0);
}

TEST_F(Assembler, BeginningsOfEverNewSendersDisplaceTheOldestOnly) {
  const std::vector<Bytes> message = fragments_of(numbers(100'000), 60'000);
  for (std::uint16_t port = 1; port <= 100; ++port) EXPECT_EQ(add({9, port}, message[0]), "");
  EXPECT_EQ(assembler_.account().incomplete, 92);
  EXPECT_EQ(add({9, 92}, message[1]), "");
  EXPECT_EQ(add({9, 93}, message[1]), "SP_POINTS:100000");
  EXPECT_EQ(add({9, 100}, message[1]), "SP_POINTS:100000");
}

TEST_F(Assembler, RandomlyChangedDatagramsDoNoHarm) {
  std::mt19937 random(5);
  const auto below = [&random](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  std::vector<Bytes> originals = fragments_of(numbers(3000), 700);
  originals.push_back(whole("INS", numbers(50)));
  int complete = 0;
  for (int k = 0; k < 200'000; ++k) {
    Bytes d = originals[below(originals.size())];
    for (std::size_t changes = below(3); changes > 0; --changes) {
      d[below(std::min<std::size_t>(d.size(), 40))] = static_cast<std::uint8_t>(below(256));
    }
    if (below(10) == 0) d.resize(below(d.size()));
    if (!add({1, static_cast<std::uint16_t>(below(4))}, d).empty()) ++complete;
  }
  EXPECT_GT(complete, 1000);
  // It still works.
  std::string last;
  for (const Bytes& f : fragments_of(numbers(3000), 700)) last = add(kBob, f);
  EXPECT_EQ(last, "SP_POINTS:3000");
}

}  // namespace
}  // namespace rcs
