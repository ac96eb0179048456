#pragma once
// Real data for tests: found by RCS_DATA_DIR, unpacked into a temporary folder.

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "rcs/base/check.h"

namespace rcs::test {

inline constexpr char kNoData[] =
    "SKIPPED: no real data. Set RCS_DATA_DIR to the folder that holds it.";

/// Path of a file below RCS_DATA_DIR, or empty when there is none.
inline std::string data_path(const std::string& relative) {
  const char* root = std::getenv("RCS_DATA_DIR");
  if (root == nullptr) return {};
  const std::filesystem::path path = std::filesystem::path(root) / relative;
  return std::filesystem::exists(path) ? path.string() : std::string();
}

/// Unpacks a .tar.xz below RCS_DATA_DIR into a new folder of this process; empty without data.
inline std::string unpacked(const std::string& relative) {
  const std::string archive = data_path(relative);
  if (archive.empty()) return {};
  std::string folder = (std::filesystem::temp_directory_path() / "rcs_test_XXXXXX").string();
  RCS_CHECK(mkdtemp(folder.data()) != nullptr);
  const std::string command = "tar xJf '" + archive + "' -C '" + folder + "'";
  RCS_CHECK(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c)
  return folder;
}

}  // namespace rcs::test
