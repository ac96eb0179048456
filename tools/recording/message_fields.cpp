#include "tools/recording/message_fields.h"

#include <fmt/format.h>

#include <cstddef>
#include <type_traits>

#include "lcmtypes/channel_types.h"

namespace rcs::recording {
namespace {

class FieldWriter {
 public:
  explicit FieldWriter(Fields* fields, std::string prefix = "")
      : fields_(*fields), prefix_(std::move(prefix)) {}

  void operator()(std::string_view name, const std::string& value) { add(name, value); }
  template <class T, std::enable_if_t<std::is_arithmetic_v<T>, int> = 0>
  void operator()(std::string_view name, T value) {
    if constexpr (sizeof(T) == 1) {
      add(name, fmt::format("{}", static_cast<int>(value)));
    } else {
      add(name, fmt::format("{}", value));
    }
  }
  /// Arrays of fixed length: one column per entry.
  template <class T, std::size_t N>
  void operator()(std::string_view name, const T (&values)[N]) {
    for (std::size_t i = 0; i < N; ++i) (*this)(fmt::format("{}_{}", name, i), values[i]);
  }
  /// Arrays of variable length: their length is a separate field.
  template <class T>
  void operator()(std::string_view, const std::vector<T>&) {}
  /// A nested message: one column per field.
  template <class T, std::enable_if_t<std::is_class_v<T>, int> = 0>
  void operator()(std::string_view name, const T& message) {
    for_each_field(message, FieldWriter(&fields_, fmt::format("{}{}_", prefix_, name)));
  }

 private:
  void add(std::string_view name, std::string value) {
    fields_.emplace_back(prefix_ + std::string(name), std::move(value));
  }

  Fields& fields_;
  std::string prefix_;
};

std::int64_t read_int64(const std::uint8_t* p) {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8 | p[i];
  return static_cast<std::int64_t>(value);
}

}  // namespace

bool known_channel(std::string_view channel) {
  return channel::with_type_of(channel, [](const auto*) {});
}

std::optional<MessageHead> read_head(std::string_view channel, const std::uint8_t* data,
                                     std::size_t size) {
  constexpr std::size_t kHeadBytes = 24;  // fingerprint of the type, utime, seq
  std::int64_t fingerprint = 0;
  const bool known = channel::with_type_of(channel, [&fingerprint](const auto* type) {
    fingerprint = std::remove_pointer_t<decltype(type)>::getHash();
  });
  if (!known || size < kHeadBytes || read_int64(data) != fingerprint) return std::nullopt;
  return MessageHead{read_int64(data + 8), read_int64(data + 16)};
}

std::optional<Fields> read_fields(std::string_view channel, const std::vector<std::uint8_t>& data) {
  std::optional<Fields> fields;
  channel::with_type_of(channel, [&](const auto* type) {
    std::remove_const_t<std::remove_pointer_t<decltype(type)>> message{};
    const int size = static_cast<int>(data.size());
    if (message.decode(data.data(), 0, size) != size) return;
    fields.emplace();
    for_each_field(message, FieldWriter(&*fields));
  });
  return fields;
}

}  // namespace rcs::recording
