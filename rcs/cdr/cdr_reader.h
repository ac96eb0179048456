#pragma once
// Reads XCDR1, little-endian, from untrusted bytes: see cdr_writer.h for the format.

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "rcs/base/byte_codec.h"
#include "rcs/cdr/cdr_writer.h"

namespace rcs::cdr {

/// Reads one payload. Every read is bounded by the payload; after the first failure ok() is false,
/// and values are zeros. Nothing throws.
class Reader {
 public:
  /// @param data  with the header of 4 bytes, whose options are ignored; outlives the reader
  Reader(const std::uint8_t* data, std::size_t size) {
    if (size < kHeader.size() || data[0] != kHeader[0] || data[1] != kHeader[1]) {
      ok_ = false;
      return;
    }
    data_ = data + kHeader.size();
    size_ = size - kHeader.size();
  }

  template <class T>
  T number() {
    T value{};
    numbers(&value, 1);
    return value;
  }
  /// Writes n values to `values`; untouched after a failure.
  template <class T>
  void numbers(T* values, std::size_t n) {
    if (n == 0 || !ok_) return;
    const std::size_t gap = padding(at_, sizeof(T));
    if (left() < gap || (left() - gap) / sizeof(T) < n) {
      ok_ = false;
      return;
    }
    at_ += gap;
    if constexpr (kHostIsLittleEndian) {
      std::memcpy(values, data_ + at_, n * sizeof(T));
    } else {
      for (std::size_t i = 0; i < n; ++i) values[i] = wire::take<T>(data_ + at_ + i * sizeof(T));
    }
    at_ += n * sizeof(T);
  }
  /// A string without a terminator, or with a second one, is a failure.
  std::string text() {
    const std::size_t n = number<std::uint32_t>();
    if (!ok_ || n == 0 || n > left() ||
        std::memchr(data_ + at_, 0, n) != static_cast<const void*>(data_ + at_ + n - 1)) {
      ok_ = false;
      return {};
    }
    std::string value(reinterpret_cast<const char*>(data_ + at_), n - 1);
    at_ += n;
    return value;
  }
  /// The number of elements of a sequence; 0 and a failure if they cannot be in the bytes left.
  /// @param min_bytes  smallest size of an element, at least 1
  std::size_t length(std::size_t min_bytes) {
    const std::size_t n = number<std::uint32_t>();
    if (ok_ && n > left() / min_bytes) ok_ = false;
    return ok_ ? n : 0;
  }

  void fail() { ok_ = false; }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t left() const { return size_ - at_; }

 private:
  const std::uint8_t* data_ = nullptr;  // after the header
  std::size_t size_ = 0;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace rcs::cdr
