#include "rcs/base/printable.h"

namespace rcs {
namespace {

std::string escaped(std::string_view text, bool keeps_lines) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : '\0');
    const bool second_set = byte == 0xC2 && next >= 0x80 && next < 0xA0;
    const bool first_set =
        (byte < 0x20 && !(keeps_lines && (byte == '\n' || byte == '\t'))) || byte == 0x7F;
    if (!first_set && !second_set) {
      out += text[i];
      continue;
    }
    if (second_set) {
      byte = next;
      ++i;
    }
    out += "\\u00";
    out += kDigits[byte >> 4U];
    out += kDigits[byte & 15U];
  }
  return out;
}

}  // namespace

std::string printable(std::string_view text) { return escaped(text, true); }

std::string printable_line(std::string_view text) { return escaped(text, false); }

}  // namespace rcs
