// libFuzzer: a sequence of datagrams on the port of the bus. Each begins with its size (2 bytes)
// and its sender (1 byte).

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/node/bus/udpm_assembler.h"
#include "tests/fuzz/seeds.h"

namespace {

using rcs::test::Bytes;

void append(Bytes* all, std::uint8_t sender, const Bytes& datagram) {
  all->push_back(static_cast<std::uint8_t>(datagram.size() >> 8U));
  all->push_back(static_cast<std::uint8_t>(datagram.size()));
  all->push_back(sender);
  all->insert(all->end(), datagram.begin(), datagram.end());
}

Bytes fragment(std::uint8_t number, std::uint8_t count, std::uint8_t offset, bool channel) {
  Bytes d = {0x4c, 0x43, 0x30, 0x33, 0, 0, 0, 7, 0, 0, 0, 8, 0, 0, 0, offset, 0, number, 0, count};
  if (channel) d.insert(d.end(), {'I', 'N', 'S', 0});
  d.insert(d.end(), {1, 2, 3, 4});
  return d;
}

std::vector<Bytes> seeds() {
  Bytes whole;
  append(&whole, 1, {0x4c, 0x43, 0x30, 0x32, 0, 0, 0, 1, 'I', 'N', 'S', 0, 1, 2});
  Bytes fragments;
  append(&fragments, 1, fragment(0, 2, 0, true));
  append(&fragments, 2, fragment(0, 2, 0, true));
  append(&fragments, 1, fragment(1, 2, 4, false));
  append(&fragments, 2, fragment(1, 2, 5, false));
  return {whole, fragments};
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  rcs::UdpmAssembler assembler;
  unsigned sum = 0;
  while (size >= 3) {
    const std::size_t length = std::min<std::size_t>(data[0] * 256U + data[1], size - 3);
    const rcs::UdpmSender from{1, data[2]};
    const Bytes datagram(data + 3, data + 3 + length);  // asan finds a read beyond its end
    const auto m = assembler.add(from, datagram.data(), datagram.size(),
                                 [](std::string_view channel) { return channel != "OTHER"; });
    if (m) {
      for (std::size_t k = 0; k < m->size; ++k) sum += m->data[k];
      if (m->channel.empty() || m->channel.size() > rcs::UdpmAssembler::kMaxChannel)
        __builtin_trap();
    }
    data += 3 + length;
    size -= 3 + length;
  }
  volatile unsigned used = sum;
  (void)used;
  return 0;
}
