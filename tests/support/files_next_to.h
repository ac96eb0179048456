#pragma once
// Files next to a file or folder whose name begins with its name.

#include <filesystem>
#include <string>
#include <vector>

namespace rcs::test {

/// @return names, "PATH." and the rest
inline std::vector<std::string> files_next_to(const std::string& path) {
  const std::filesystem::path whole(path);
  const std::string stem = whole.filename().string() + ".";
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(whole.parent_path())) {
    const std::string name = entry.path().filename().string();
    if (name.compare(0, stem.size(), stem) == 0) names.push_back(name);
  }
  return names;
}

}  // namespace rcs::test
