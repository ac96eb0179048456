#include "rcs/ros2/schema.h"

#include <algorithm>

namespace rcs::ros2 {
namespace {

std::string message_text(const TypeDescription& type) {
  std::string text;
  for (const ConstantDescription& c : type.constants) {
    text += c.type + " " + c.name + "=" + std::to_string(c.value) + "\n";
  }
  for (const FieldDescription& f : type.fields) {
    text += f.type;
    if (f.fixed > 0) text += "[" + std::to_string(f.fixed) + "]";
    if (f.sequence) text += "[]";
    text += " " + f.name + "\n";
  }
  return text;
}

/// "std_msgs::msg::dds_::Header_" of "std_msgs/Header".
std::string idl_name(const std::string& name) {
  const std::size_t slash = name.find('/');
  return name.substr(0, slash) + "::msg::dds_::" + name.substr(slash + 1) + "_";
}

std::string idl_type(const FieldDescription& field) {
  if (field.is_message) return idl_name(field.type);
  if (field.type == "float32") return "float";
  if (field.type == "float64") return "double";
  if (field.type == "bool") return "boolean";
  if (field.type == "byte") return "octet";
  return field.type;  // string, int8 ... uint64
}

}  // namespace

std::string camel_case(std::string_view lcm_type) {
  std::string name;
  bool begins = true;
  const std::size_t end = lcm_type.size() - 2;  // without "_t"
  for (const char c : lcm_type.substr(0, end)) {
    if (c != '_') name += begins && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    begins = c == '_';
  }
  return name;
}

std::string descriptor_list(const std::vector<TypeDescription>& types) {
  std::string text;
  for (const TypeDescription& type : types) {
    const std::size_t slash = type.name.find('/');
    text += "{\"" + type.name + "\", &" + type.name.substr(0, slash) + "_msg_dds__" +
            type.name.substr(slash + 1) + "__desc},\n";
  }
  return text;
}

std::string schema_name(const std::string& type_name) {
  const std::size_t slash = type_name.find('/');
  return type_name.substr(0, slash) + "/msg" + type_name.substr(slash);
}

std::string schema_text(const std::vector<TypeDescription>& types) {
  if (types.empty()) return {};
  std::string text = message_text(types.back());
  for (std::size_t i = 0; i + 1 < types.size(); ++i) {
    text += std::string(80, '=') + "\nMSG: " + types[i].name + "\n" + message_text(types[i]);
  }
  return text;
}

std::string idl_text(const std::vector<TypeDescription>& types) {
  std::string text;
  for (const TypeDescription& type : types) {
    const std::size_t slash = type.name.find('/');
    text += "module " + type.name.substr(0, slash) +
            " { module msg { module dds_ {\n  @final struct " + type.name.substr(slash + 1) +
            "_ {\n";
    for (const FieldDescription& f : type.fields) {
      const std::string element = idl_type(f);
      text += "    " + (f.sequence ? "sequence<" + element + ">" : element) + " " + f.name;
      if (f.fixed > 0) text += "[" + std::to_string(f.fixed) + "]";
      text += ";\n";
    }
    text += "  };\n}; }; };\n";
  }
  return text;
}

}  // namespace rcs::ros2
