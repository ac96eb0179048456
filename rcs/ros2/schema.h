#pragma once
// Descriptions of message types as text: the schema `ros2msg` of MCAP, and IDL for DDS. They derive
// from the same fields as the bytes. Our own message types (lcmtypes) become rcs_msgs/msg/X:
// nav_state_t is rcs_msgs/msg/NavState.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "lcmtypes/rcs/message_fields.hpp"
#include "rcs/cdr/cdr_message.h"
#include "rcs/ros2/basic_types.h"

namespace rcs::ros2 {

struct FieldDescription {
  std::string type;  ///< "float64", "string", "geometry_msgs/Point"
  std::string name;
  std::size_t fixed = 0;  ///< number of elements of an array of fixed length; 0: not an array
  bool sequence = false;  ///< array of variable length
  bool is_message = false;
};

struct ConstantDescription {
  std::string type;
  std::string name;
  std::int64_t value = 0;
};

struct TypeDescription {
  std::string name;  ///< "std_msgs/Header"
  std::vector<FieldDescription> fields;
  std::vector<ConstantDescription> constants;
};

/// "NavState" of "nav_state_t".
[[nodiscard]] std::string camel_case(std::string_view lcm_type);

/// "nav_msgs/Odometry" or "rcs_msgs/NavState".
template <class T>
std::string type_name() {
  if constexpr (msg::HasFields<T>::value) {
    return T::kName;
  } else {
    return "rcs_msgs/" + camel_case(T::getTypeName());
  }
}

template <class T>
std::string element_type() {
  if constexpr (std::is_same_v<T, bool>) {
    return "bool";
  } else if constexpr (std::is_same_v<T, msg::Byte>) {
    return "byte";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "string";
  } else if constexpr (std::is_floating_point_v<T>) {
    return sizeof(T) == 4 ? "float32" : "float64";
  } else if constexpr (std::is_integral_v<T>) {
    return (std::is_signed_v<T> ? "int" : "uint") + std::to_string(8 * sizeof(T));
  } else {
    return type_name<T>();
  }
}

template <class T>
void describe(std::vector<TypeDescription>* types);

/// Describes the type T of a field, and appends the types of messages that it contains.
template <class T>
void describe_field(FieldDescription* field, std::vector<TypeDescription>* types) {
  if constexpr (std::is_array_v<T>) {
    field->fixed = (field->fixed == 0 ? 1 : field->fixed) * std::extent_v<T>;
    describe_field<std::remove_extent_t<T>>(field, types);
  } else if constexpr (cdr::IsStdArray<T>::value) {
    field->fixed = std::tuple_size_v<T>;
    describe_field<typename T::value_type>(field, types);
  } else if constexpr (cdr::IsSequence<T>::value) {
    field->sequence = true;
    describe_field<typename T::value_type>(field, types);
  } else {
    field->type = element_type<T>();
    field->is_message = !cdr::kIsNumber<T> && !std::is_same_v<T, std::string>;
    if constexpr (!cdr::kIsNumber<T> && !std::is_same_v<T, std::string>) describe<T>(types);
  }
}

/// Appends T and the types that it contains, each after those that it contains itself; types that
/// are there already are omitted.
template <class T>
void describe(std::vector<TypeDescription>* types) {
  TypeDescription described;
  described.name = type_name<T>();
  for (const TypeDescription& there : *types) {
    if (there.name == described.name) return;
  }
  const T message{};
  for_each_field(message, [&](std::string_view name, const auto& value) {
    FieldDescription field;
    field.name = name;
    describe_field<std::remove_cv_t<std::remove_reference_t<decltype(value)>>>(&field, types);
    described.fields.push_back(std::move(field));
  });
  if constexpr (!msg::HasFields<T>::value) {
    for_each_constant(message, [&](std::string_view name, auto value) {
      described.constants.push_back(
          {element_type<decltype(value)>(), std::string(name), static_cast<std::int64_t>(value)});
    });
  }
  types->push_back(std::move(described));
}

/// In the form `ros2msg` of MCAP: the last type first, then each other type after a line of 80 "="
/// and a line "MSG: package/Type".
[[nodiscard]] std::string schema_text(const std::vector<TypeDescription>& types);

/// In IDL 4.2, with the names of ROS 2 on DDS (pkg::msg::dds_::Name_) and without constants.
[[nodiscard]] std::string idl_text(const std::vector<TypeDescription>& types);

/// Names and the descriptors that idlc makes of idl_text(): {"tf2_msgs/TFMessage", &...__desc}, a
/// line each.
[[nodiscard]] std::string descriptor_list(const std::vector<TypeDescription>& types);

/// "nav_msgs/msg/Odometry" of "nav_msgs/Odometry": the name of a schema.
[[nodiscard]] std::string schema_name(const std::string& type_name);

/// A type of a topic, for a reader.
struct Schema {
  std::string name;  ///< "nav_msgs/msg/Odometry"
  std::string text;
};

template <class T>
const Schema& schema_of() {
  static const Schema kSchema = [] {
    std::vector<TypeDescription> types;
    describe<T>(&types);
    return Schema{schema_name(type_name<T>()), schema_text(types)};
  }();
  return kSchema;
}

}  // namespace rcs::ros2
