#pragma once
// XCDR1 of whole messages. A message is a struct for which argument-dependent lookup finds
// for_each_field(message, visit), which calls visit("name", message.name) for every field in the
// order of the definition; constant messages give constant fields. A field is an arithmetic type,
// an enumeration of one byte, std::string, an array of fixed length (C array of any dimension,
// row by row, or std::array), std::vector (a sequence), or a message.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "rcs/cdr/cdr_reader.h"
#include "rcs/cdr/cdr_writer.h"

namespace rcs::cdr {

template <class T>
struct IsSequence : std::false_type {};
template <class T>
struct IsSequence<std::vector<T>> : std::true_type {};
template <class T>
struct IsStdArray : std::false_type {};
template <class T, std::size_t N>
struct IsStdArray<std::array<T, N>> : std::true_type {};

/// Written as itself: all that is not a string, an array or a message.
template <class T>
inline constexpr bool kIsNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;

template <class T>
void write_value(const T& value, Writer* out) {
  if constexpr (std::is_same_v<T, bool>) {
    out->number(static_cast<std::uint8_t>(value));
  } else if constexpr (kIsNumber<T>) {
    out->number(value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    out->text(value);
  } else if constexpr (std::is_array_v<T> || IsStdArray<T>::value || IsSequence<T>::value) {
    using Element = std::decay_t<decltype(value[0])>;
    if constexpr (IsSequence<T>::value) out->length(value.size());
    if constexpr (kIsNumber<Element> && !std::is_array_v<std::remove_extent_t<T>>) {
      static_assert(!std::is_same_v<Element, bool>);
      out->numbers(std::data(value), std::size(value));
    } else {
      for (const auto& element : value) write_value(element, out);
    }
  } else {
    for_each_field(value, [out](std::string_view, const auto& field) { write_value(field, out); });
  }
}

/// Number of bytes of the smallest encoding of a T, without padding.
template <class T>
std::size_t min_bytes() {
  if constexpr (kIsNumber<T>) {
    return sizeof(T);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return 5;  // the length and the terminator
  } else if constexpr (IsSequence<T>::value) {
    return 4;
  } else if constexpr (std::is_array_v<T>) {
    return std::extent_v<T> * min_bytes<std::remove_extent_t<T>>();
  } else if constexpr (IsStdArray<T>::value) {
    return std::tuple_size_v<T> * min_bytes<typename T::value_type>();
  } else {
    static const std::size_t kSum = [] {
      const T instance{};
      std::size_t sum = 0;
      for_each_field(instance, [&sum](std::string_view, const auto& field) {
        sum += min_bytes<std::remove_cv_t<std::remove_reference_t<decltype(field)>>>();
      });
      return sum;
    }();
    return kSum;
  }
}

/// Check in->ok() afterwards.
template <class T>
void read_value(Reader* in, T* value) {
  if constexpr (std::is_same_v<T, bool>) {
    const auto byte = in->number<std::uint8_t>();
    if (byte > 1) in->fail();
    *value = byte == 1;
  } else if constexpr (kIsNumber<T>) {
    in->numbers(value, 1);
  } else if constexpr (std::is_same_v<T, std::string>) {
    *value = in->text();
  } else if constexpr (std::is_array_v<T> || IsStdArray<T>::value || IsSequence<T>::value) {
    using Element = std::decay_t<decltype((*value)[0])>;
    if constexpr (IsSequence<T>::value) value->resize(in->length(min_bytes<Element>()));
    if constexpr (kIsNumber<Element> && !std::is_array_v<std::remove_extent_t<T>>) {
      in->numbers(std::data(*value), std::size(*value));
    } else {
      for (auto& element : *value) {
        if (in->ok()) read_value(in, &element);
      }
    }
  } else {
    for_each_field(*value, [in](std::string_view, auto& field) {
      if (in->ok()) read_value(in, &field);
    });
  }
}

/// @param out  replaced by the payload with its header
template <class T>
void write_message(const T& message, std::vector<std::uint8_t>* out) {
  Writer writer(out);
  write_value(message, &writer);
}

/// @return false: the bytes are not a T, or up to 7 bytes of padding do not end them. Then
///   `message` has some of the values. Memory is bounded by a multiple of `size`.
template <class T>
[[nodiscard]] bool read_message(const std::uint8_t* data, std::size_t size, T* message) {
  Reader reader(data, size);
  read_value(&reader, message);
  return reader.ok() && reader.left() < 8;
}

}  // namespace rcs::cdr
