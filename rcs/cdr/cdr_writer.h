#pragma once
// XCDR1 (OMG DDS-XTypes 1.3, 7.4; "plain CDR" of ROS 2 and of MCAP's encoding `cdr`),
// little-endian.
//
// A payload is a header of 4 bytes, 00 01 00 00, and the values. A primitive of n bytes begins at a
// multiple of n, counted from the end of the header; the gap has zeros.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "rcs/base/byte_codec.h"

namespace rcs::cdr {

/// Representation identifier CDR_LE, and two bytes of options.
inline constexpr std::array<std::uint8_t, 4> kHeader = {0x00, 0x01, 0x00, 0x00};

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
inline constexpr bool kHostIsLittleEndian = true;
#else
inline constexpr bool kHostIsLittleEndian = false;
#endif

/// Number of bytes from `position` to the next multiple of `alignment`, a power of two.
constexpr std::size_t padding(std::size_t position, std::size_t alignment) {
  return (alignment - position % alignment) % alignment;
}

/// Writes one payload. Allocates nothing but the growth of the output.
class Writer {
 public:
  /// @param out  replaced by the payload; its capacity is reused
  explicit Writer(std::vector<std::uint8_t>* out) : out_(*out) {
    out_.assign(kHeader.begin(), kHeader.end());
  }

  /// Of 1, 2, 4 or 8 bytes.
  template <class T>
  void number(T value) {
    const std::size_t at = room_for<T>(1);
    wire::put(value, out_.data() + at);
  }
  /// @param n  may be 0: then nothing is written, and nothing is aligned
  template <class T>
  void numbers(const T* values, std::size_t n) {
    if (n == 0) return;
    std::size_t at = room_for<T>(n);
    if constexpr (kHostIsLittleEndian) {
      std::memcpy(out_.data() + at, values, n * sizeof(T));
    } else {
      for (std::size_t i = 0; i < n; ++i, at += sizeof(T)) wire::put(values[i], out_.data() + at);
    }
  }
  /// The length with its terminator, the characters, and the terminator.
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    out_.insert(out_.end(), value.begin(), value.end());
    out_.push_back(0);
  }
  /// Of a sequence; its elements follow.
  void length(std::size_t n) { number(static_cast<std::uint32_t>(n)); }

 private:
  /// Appends aligned room for n values. @return its offset in the output
  template <class T>
  std::size_t room_for(std::size_t n) {
    const std::size_t gap = padding(out_.size() - kHeader.size(), sizeof(T));
    const std::size_t at = out_.size() + gap;
    out_.resize(at + n * sizeof(T));  // the gap becomes zeros
    return at;
  }

  std::vector<std::uint8_t>& out_;
};

}  // namespace rcs::cdr
