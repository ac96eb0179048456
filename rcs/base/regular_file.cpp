#include "rcs/base/regular_file.h"

#include <filesystem>
#include <system_error>

#include "rcs/base/input_files.h"

namespace rcs {

Outcome check_regular_file(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found || status.type() == fs::file_type::none) {
    return Error{path + ": cannot open: " + error.message()};
  }
  if (status.type() != fs::file_type::regular) return Error{path + ": is not a regular file"};
  report_input(path);
  return Done{};
}

}  // namespace rcs
