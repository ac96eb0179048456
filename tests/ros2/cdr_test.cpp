// XCDR1: alignment, bounds, and random damage.

#include "rcs/cdr/cdr_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/ros2/all_types.h"
#include "tests/support/random_message.h"

namespace rcs::cdr {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::ElementsAre;

TEST(Cdr, NumbersAreAlignedFromTheEndOfTheHeader) {
  Bytes bytes;
  Writer out(&bytes);
  out.number(std::uint8_t{1});
  out.number(std::uint16_t{0x0302});
  out.number(std::uint8_t{4});
  out.number(std::uint32_t{0x08070605});
  out.number(std::uint64_t{0x100F0E0D0C0B0A09});
  EXPECT_THAT(bytes, ElementsAre(0, 1, 0, 0,              // header
                                 1, 0, 2, 3,              // u8, gap, u16
                                 4, 0, 0, 0, 5, 6, 7, 8,  // u8, gap, u32
                                 0, 0, 0, 0,              // gap to 16
                                 9, 10, 11, 12, 13, 14, 15, 16));
  Reader in(bytes.data(), bytes.size());
  EXPECT_EQ(in.number<std::uint8_t>(), 1);
  EXPECT_EQ(in.number<std::uint16_t>(), 0x0302);
  EXPECT_EQ(in.number<std::uint8_t>(), 4);
  EXPECT_EQ(in.number<std::uint32_t>(), 0x08070605U);
  EXPECT_EQ(in.number<std::uint64_t>(), 0x100F0E0D0C0B0A09U);
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.left(), 0U);
  EXPECT_EQ(in.number<std::uint8_t>(), 0) << "past the end";
  EXPECT_FALSE(in.ok());
}

TEST(Cdr, AnEmptySequenceAlignsNothing) {
  Bytes bytes;
  write_message(path_query_t{}, &bytes);  // x_m and y_m are empty sequences of doubles
  // Four int64, "" (5 bytes), gap, int64, n, two lengths.
  EXPECT_EQ(bytes.size(), 4U + 32U + 5U + 3U + 8U + 4U + 4U + 4U);
}

TEST(Cdr, AStringHasOneTerminatorAtItsEnd) {
  Bytes bytes;
  Writer(&bytes).text("ab");
  EXPECT_THAT(bytes, ElementsAre(0, 1, 0, 0, 3, 0, 0, 0, 'a', 'b', 0));
  EXPECT_EQ(Reader(bytes.data(), bytes.size()).text(), "ab");
  using Change = std::pair<std::size_t, std::uint8_t>;  // offset, value
  for (const auto& [at, value] : {Change{10, 'c'}, Change{8, 0}, Change{4, 2}}) {
    Bytes damaged = bytes;
    damaged[at] = value;
    Reader in(damaged.data(), damaged.size());
    EXPECT_EQ(in.text(), "");
    EXPECT_FALSE(in.ok()) << at;
  }
}

TEST(Cdr, ALengthIsBoundedByTheBytesLeft) {
  Bytes bytes;
  write_message(ladar_ranges_t{}, &bytes);
  wire::put(std::numeric_limits<std::uint32_t>::max(), bytes.data() + bytes.size() - 4);
  ladar_ranges_t m{};
  EXPECT_FALSE(read_message(bytes.data(), bytes.size(), &m));
  EXPECT_TRUE(m.range_m.empty());
}

TEST(Cdr, OtherRepresentationsAreRejected) {
  ins_t m{};
  Bytes bytes;
  write_message(m, &bytes);
  EXPECT_TRUE(read_message(bytes.data(), bytes.size(), &m));
  bytes[3] = 3;  // options: number of padding bytes
  EXPECT_TRUE(read_message(bytes.data(), bytes.size(), &m));
  for (const int kind : {0, 2, 3, 6, 7}) {  // big-endian, parameter lists, XCDR2
    bytes[1] = static_cast<std::uint8_t>(kind);
    EXPECT_FALSE(read_message(bytes.data(), bytes.size(), &m)) << kind;
  }
  EXPECT_FALSE(read_message(bytes.data(), 3, &m));
  EXPECT_FALSE(read_message(nullptr, 0, &m));
}

TEST(Cdr, EveryTypeIsReadAsItWasWritten) {
  test::for_each_type([](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    for (unsigned seed = 0; seed < 20; ++seed) {
      Bytes bytes;
      write_message(test::RandomMessage(seed).make<T>(), &bytes);
      T read{};
      ASSERT_TRUE(read_message(bytes.data(), bytes.size(), &read)) << ros2::type_name<T>();
      Bytes again;
      write_message(read, &again);
      ASSERT_EQ(again, bytes) << ros2::type_name<T>();
      for (std::size_t end = 0; end < bytes.size(); end += 1 + bytes.size() / 50) {
        T part{};
        ASSERT_FALSE(read_message(bytes.data(), end, &part)) << ros2::type_name<T>();
      }
    }
  });
}

TEST(Cdr, DamagedPayloadsAreReadOrRejected) {
  // Under the sanitizers this finds reads outside of the payload; here it bounds the memory.
  std::mt19937 random(17);
  std::size_t cases = 0;
  test::for_each_type([&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    Bytes bytes;
    write_message(test::RandomMessage(3).make<T>(), &bytes);
    for (int i = 0; i < 400; ++i, ++cases) {
      Bytes damaged = test::mutated(bytes, &random);
      damaged.shrink_to_fit();
      T message{};
      (void)read_message(damaged.data(), damaged.size(), &message);
    }
  });
  EXPECT_GT(cases, 10'000U);
}

}  // namespace
}  // namespace rcs::cdr
