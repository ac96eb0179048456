#include "tools/mcap/compression.h"

#include <zstd.h>

namespace rcs::mcap {

void ZstdCompressor::Free::operator()(void* context) const {
  ZSTD_freeCCtx(static_cast<ZSTD_CCtx*>(context));
}

ZstdCompressor::ZstdCompressor(int level) : context_(ZSTD_createCCtx()), level_(level) {}

Outcome ZstdCompressor::compress(const std::vector<std::uint8_t>& in,
                                 std::vector<std::uint8_t>* out) {
  if (context_ == nullptr) return Error{"zstd: out of memory"};
  out->resize(ZSTD_compressBound(in.size()));
  const std::size_t size = ZSTD_compressCCtx(static_cast<ZSTD_CCtx*>(context_.get()), out->data(),
                                             out->size(), in.data(), in.size(), level_);
  if (ZSTD_isError(size) != 0) return Error{std::string("zstd: ") + ZSTD_getErrorName(size)};
  out->resize(size);
  return Done{};
}

bool zstd_decompress(const std::uint8_t* in, std::size_t size, std::size_t bytes,
                     std::vector<std::uint8_t>* out) {
  // A frame states its size: an invalid one is found before memory is allocated for it.
  const unsigned long long stated = ZSTD_getFrameContentSize(in, size);
  if (stated == ZSTD_CONTENTSIZE_ERROR || (stated != ZSTD_CONTENTSIZE_UNKNOWN && stated > bytes)) {
    return false;
  }
  out->resize(bytes);
  const std::size_t got = ZSTD_decompress(out->data(), out->size(), in, size);
  return ZSTD_isError(got) == 0 && got == bytes;
}

}  // namespace rcs::mcap
