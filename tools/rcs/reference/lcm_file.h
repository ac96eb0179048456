#pragma once
// A message definition (*.lcm) with its comments, for the reference of the messages.

#include <string>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::cli {

struct LcmField {
  std::string type;  ///< "double[3]"
  std::string name;
  std::string comment;
};

struct LcmConstant {
  std::string name;
  std::string value;
  std::string comment;
};

struct LcmType {
  std::string name;
  std::string comment;
  std::vector<LcmField> fields;
  std::vector<LcmConstant> constants;
};

/// All types in a folder, by name.
[[nodiscard]] Result<std::vector<LcmType>> read_lcm_files(const std::string& folder);

/// @param text  of a file with one struct; a comment belongs to the field or constant before it
[[nodiscard]] LcmType parse_lcm(const std::string& text);

}  // namespace rcs::cli
