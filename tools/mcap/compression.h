#pragma once
// zstd, of whole chunks.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::mcap {

/// Compresses with one thread: the same input gives the same output (of one version of libzstd).
class ZstdCompressor {
 public:
  explicit ZstdCompressor(int level);

  /// @param out  replaced
  [[nodiscard]] Outcome compress(const std::vector<std::uint8_t>& in,
                                 std::vector<std::uint8_t>* out);

 private:
  struct Free {
    void operator()(void* context) const;
  };
  std::unique_ptr<void, Free> context_;
  int level_;
};

/// @param bytes  of the decompressed data, which the caller has limited
/// @param out    replaced
/// @return false: not one or several frames of zstd with exactly `bytes` bytes
[[nodiscard]] bool zstd_decompress(const std::uint8_t* in, std::size_t size, std::size_t bytes,
                                   std::vector<std::uint8_t>* out);

}  // namespace rcs::mcap
