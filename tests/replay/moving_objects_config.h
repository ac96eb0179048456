#pragma once
// config/demo3.toml with [wm.terrain] upright_m and motion_s, which it does not state.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "rcs/base/check.h"
#include "tests/replay/chain.h"
#include "tests/support/fresh_folder.h"

namespace rcs::test {

/// @return the path of the file
inline std::string with_moving_objects() {
  std::ifstream in(source_path("config/demo3.toml"));
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string table = "[wm.terrain]\n";
  const std::size_t at = text.find(table);
  RCS_CHECK(at != std::string::npos);
  text.insert(at + table.size(), "upright_m = 1.1\nmotion_s = 3.0\n");
  const std::string path = (fresh_folder() / "demo3_moving.toml").string();
  std::ofstream(path) << text;
  return path;
}

}  // namespace rcs::test
