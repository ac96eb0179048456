#include "tests/fuzz/seeds.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "rcs/base/check.h"

namespace rcs::test {
namespace {

Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& p : parts) all.insert(all.end(), p.begin(), p.end());
  return all;
}

}  // namespace

std::vector<Bytes> spoil(const std::vector<Bytes>& good) {
  const Bytes& first = good.front();
  const Bytes& middle = good[good.size() / 2];
  const Bytes& last = good.back();
  std::vector<Bytes> out = {first, middle, last};
  out.push_back(joined({first, middle, last}));
  out.push_back(joined({middle, middle}));
  out.push_back(joined({middle, first}));
  constexpr std::size_t kParts = 8;
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::size_t begin = middle.size() * part / kParts;
    const std::size_t end = middle.size() * (part + 1) / kParts;
    out.emplace_back(middle.begin(), middle.begin() + static_cast<std::ptrdiff_t>(begin));
    // At any offset: NaN or -1, a huge number, a negative length, zero.
    for (const int value : {0xff, 0x7f, 0x80, 0x00}) {
      Bytes bytes = middle;
      std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                bytes.begin() + static_cast<std::ptrdiff_t>(end), static_cast<std::uint8_t>(value));
      out.push_back(joined({bytes, middle}));
    }
  }
  return out;
}

int write_seeds(int argc, char** argv, const std::function<std::vector<Bytes>()>& make) {
  constexpr std::string_view kOption = "-seeds=";
  if (argc < 2 || std::string_view(argv[1]).substr(0, kOption.size()) != kOption) return 0;
  const std::filesystem::path directory = argv[1] + kOption.size();
  std::filesystem::create_directories(directory);
  int number = 0;
  for (const Bytes& bytes : make()) {
    std::ofstream out(directory / ("seed" + std::to_string(++number)), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    RCS_CHECK(out.good());
  }
  std::exit(EXIT_SUCCESS);
}

}  // namespace rcs::test
