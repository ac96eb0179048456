#pragma once
// Little-endian encoding of numbers on any host, and the checksum of map files.

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace rcs {

/// CRC-32 (IEEE 802.3).
/// @param before  CRC-32 of the bytes in front of `data`, to continue it; 0: there are none
[[nodiscard]] std::uint32_t crc32(const std::uint8_t* data, std::size_t size,
                                  std::uint32_t before = 0);

namespace wire {

template <std::size_t N>
using Unsigned = std::conditional_t<
    N == 1, std::uint8_t,
    std::conditional_t<N == 2, std::uint16_t,
                       std::conditional_t<N == 4, std::uint32_t, std::uint64_t>>>;

template <class T>
void put(T value, std::uint8_t* out) {
  Unsigned<sizeof(T)> bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out[i] = static_cast<std::uint8_t>(bits >> (8 * i));
  }
}

template <class T>
T take(const std::uint8_t* in) {
  using Bits = Unsigned<sizeof(T)>;
  Bits bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    bits = static_cast<Bits>(bits | static_cast<Bits>(static_cast<Bits>(in[i]) << (8 * i)));
  }
  T value;
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}

/// Appends values to a record.
class Writer {
 public:
  template <class T>
  void put(T value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof(T));
    wire::put(value, bytes.data() + at);
  }
  void put(const std::string& text) {  // at most 65535 characters
    put(static_cast<std::uint16_t>(text.size()));
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
  std::vector<std::uint8_t> bytes;
};

/// Reads a record. Past its end it returns zeros, and ok() is false.
class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {}
  template <class T>
  T take() {
    if (left_ < sizeof(T)) {
      ok_ = false;
      left_ = 0;
      return T{};
    }
    const T value = wire::take<T>(at_);
    at_ += sizeof(T);
    left_ -= sizeof(T);
    return value;
  }
  std::string take_text() {
    const std::size_t n = take<std::uint16_t>();
    if (left_ < n) {
      ok_ = false;
      return {};
    }
    std::string text(at_, at_ + n);
    at_ += n;
    left_ -= n;
    return text;
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t left() const { return left_; }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  bool ok_ = true;
};

}  // namespace wire
}  // namespace rcs
