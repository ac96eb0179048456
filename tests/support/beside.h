#pragma once
// What lies beside a file or folder under a name that begins with its own.

#include <filesystem>
#include <string>
#include <vector>

namespace rcs::test {

/// @return names, "PATH." and what follows
inline std::vector<std::string> beside(const std::string& path) {
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
