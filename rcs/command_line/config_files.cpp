#include "rcs/command_line/config_files.h"

#include <filesystem>

namespace rcs::command_line {

std::string find_config(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code failed;
  if (path.empty() || fs::path(path).is_absolute() || fs::exists(path, failed)) return path;
  fs::path folder = fs::read_symlink("/proc/self/exe", failed).parent_path();
  for (; folder.has_relative_path(); folder = folder.parent_path()) {
    for (const char* data : {"", "share/rcs"}) {
      const fs::path found = folder / data / path;
      if (fs::exists(found, failed)) return found.string();
    }
  }
  return path;
}

CLI::Validator config_path() {
  return CLI::Validator(
      [](std::string& path) {
        path = find_config(path);
        return std::string();
      },
      "");
}

CLI::Validator config_file() {
  return CLI::Validator(
      [](std::string& path) {
        path = find_config(path);
        return CLI::ExistingFile(path);
      },
      "FILE", "config_file");
}

}  // namespace rcs::command_line
