#pragma once
// Messages with random content, of any type with for_each_field().

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace rcs::test {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};
template <class T>
struct IsArray : std::is_array<T> {};
template <class T, std::size_t N>
struct IsArray<std::array<T, N>> : std::true_type {};

/// Fills messages. All arrays of variable length in a message have the same length, and so have the
/// length fields of our own types (n, n_*), so that such a message can be encoded.
class RandomMessage {
 public:
  explicit RandomMessage(unsigned seed) : random_(seed) {}

  template <class T>
  T make() {
    length_ = random_() % 4;
    T message{};
    fill(&message);
    return message;
  }

 private:
  template <class T>
  void fill(T* value) {
    if constexpr (std::is_same_v<T, bool>) {
      *value = random_() % 2 == 1;
    } else if constexpr (std::is_floating_point_v<T>) {
      *value = static_cast<T>(std::normal_distribution<double>(0.0, 1e3)(random_));
      if (random_() % 16 == 0) *value = static_cast<T>(-0.0);
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      const std::uint64_t bits = std::uint64_t{random_()} << 32U | random_();
      std::memcpy(value, &bits, sizeof(T));
    } else if constexpr (std::is_same_v<T, std::string>) {
      value->assign(random_() % 9, ' ');
      for (char& c : *value) c = static_cast<char>('!' + random_() % 90);
    } else if constexpr (IsVector<T>::value) {
      value->resize(length_);
      for (auto& element : *value) fill(&element);
    } else if constexpr (IsArray<T>::value) {
      for (auto& element : *value) fill(&element);
    } else {
      for_each_field(*value, [this](std::string_view name, auto& field) {
        using Field = std::remove_reference_t<decltype(field)>;
        if constexpr (std::is_same_v<Field, std::int32_t>) {
          if (name == "n" || name.substr(0, 2) == "n_") {
            field = static_cast<std::int32_t>(length_);
            return;
          }
        }
        fill(&field);
      });
    }
  }

  std::mt19937 random_;
  std::size_t length_ = 0;
};

/// A damaged copy: bytes overwritten, inserted and removed, and lengths set to extremes.
inline std::vector<std::uint8_t> mutated(std::vector<std::uint8_t> bytes, std::mt19937* random) {
  const auto below = [random](std::size_t n) { return static_cast<std::size_t>((*random)()) % n; };
  for (std::size_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes) {
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
      case 0:
        bytes[at] = static_cast<std::uint8_t>((*random)());
        break;
      case 1:
        bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1U << below(8)));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), 1 + below(9), 0xFF);
        break;
      case 4:
        bytes.erase(
            bytes.begin() + static_cast<std::ptrdiff_t>(at),
            bytes.begin() + static_cast<std::ptrdiff_t>(std::min(bytes.size(), at + 1 + below(9))));
        break;
      default:
        for (std::size_t k = at; k < std::min(bytes.size(), at + 4); ++k) bytes[k] = 0xFF;
    }
  }
  return bytes;
}

}  // namespace rcs::test
