#include "rcs/node/bus/udpm_assembler.h"

#include <algorithm>

namespace rcs {
namespace {

constexpr std::uint32_t kWhole = 0x4c433032;     // "LC02"
constexpr std::uint32_t kFragment = 0x4c433033;  // "LC03"
constexpr std::size_t kWholeHeader = 8;
constexpr std::size_t kFragmentHeader = 20;

std::uint32_t big_endian(const std::uint8_t* p, int bytes) {
  std::uint32_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8U | p[i];
  return v;
}

}  // namespace

std::optional<UdpmAssembler::Datagram> UdpmAssembler::parse(const std::uint8_t* data,
                                                            std::size_t size) {
  Datagram d;
  const auto malformed = [this] {
    ++account_.malformed;
    return std::nullopt;
  };
  if (size < kWholeHeader) return malformed();
  const std::uint32_t magic = big_endian(data, 4);
  d.sequence = big_endian(data + 4, 4);
  if (magic == kWhole) {
    d.data = data + kWholeHeader;
    d.size = size - kWholeHeader;
    return take_channel(&d) ? std::optional(d) : malformed();
  }
  if (magic != kFragment || size < kFragmentHeader) return malformed();
  d.message_size = big_endian(data + 8, 4);
  d.offset = big_endian(data + 12, 4);
  d.number = static_cast<std::uint16_t>(big_endian(data + 16, 2));
  d.count = static_cast<std::uint16_t>(big_endian(data + 18, 2));
  d.data = data + kFragmentHeader;
  d.size = size - kFragmentHeader;
  if (d.number >= d.count || d.message_size > kMaxMessage) return malformed();
  if (d.number == 0 && !take_channel(&d)) return malformed();
  // In 64 bits: offset and size cannot overflow.
  const std::uint64_t end = std::uint64_t{d.offset} + d.size;
  if (end > d.message_size || (d.number == 0 && d.offset != 0)) return malformed();
  return d;
}

bool UdpmAssembler::take_channel(Datagram* d) {
  const std::uint8_t* const last = d->data + std::min(d->size, kMaxChannel + 1);
  const std::uint8_t* const zero = std::find(d->data, last, std::uint8_t{0});
  if (zero == last || zero == d->data) return false;
  const auto length = static_cast<std::size_t>(zero - d->data);
  d->channel = {reinterpret_cast<const char*>(d->data), length};
  d->data += length + 1;
  d->size -= length + 1;
  return true;
}

// liblcm sends the fragments in their order, and a loopback interface keeps it.
std::optional<UdpmMessage> UdpmAssembler::add_fragment(const UdpmSender& from, const Datagram& d) {
  Partial* const p = d.number == 0 ? begin(from, d) : find(from);
  if (p == nullptr || p->sequence != d.sequence) return std::nullopt;  // its beginning was not seen
  if (d.number != p->next || d.count != p->count || d.message_size != p->message_size ||
      d.offset != p->data.size()) {
    ++account_.incomplete;
    p->used = false;
    return std::nullopt;
  }
  p->data.insert(p->data.end(), d.data, d.data + d.size);
  p->touched = ++fragments_;
  ++p->next;
  if (p->next < p->count) return std::nullopt;
  p->used = false;
  if (p->data.size() != p->message_size) {
    ++account_.malformed;
    return std::nullopt;
  }
  return UdpmMessage{p->channel, p->data.data(), p->data.size()};
}

UdpmAssembler::Partial* UdpmAssembler::find(const UdpmSender& from) {
  const auto p = std::find_if(partials_.begin(), partials_.end(), [&](const Partial& q) {
    return q.used && q.from.address == from.address && q.from.port == from.port;
  });
  return p == partials_.end() ? nullptr : &*p;
}

UdpmAssembler::Partial* UdpmAssembler::begin(const UdpmSender& from, const Datagram& d) {
  forget(from);
  const auto free =
      std::find_if(partials_.begin(), partials_.end(), [](const Partial& q) { return !q.used; });
  Partial* p = free == partials_.end() ? nullptr : &*free;
  if (p == nullptr && partials_.size() < kMaxPartial) p = &partials_.emplace_back();
  if (p == nullptr) {
    ++account_.incomplete;
    p = &*std::min_element(partials_.begin(), partials_.end(),
                           [](const auto& a, const auto& b) { return a.touched < b.touched; });
  }
  p->from = from;
  p->used = true;
  p->sequence = d.sequence;
  p->message_size = d.message_size;
  p->next = 0;
  p->count = d.count;
  p->channel = d.channel;
  p->data.clear();
  return p;
}

void UdpmAssembler::forget(const UdpmSender& from) {
  Partial* const p = find(from);
  if (p == nullptr) return;
  ++account_.incomplete;
  p->used = false;
}

}  // namespace rcs
