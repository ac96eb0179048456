#pragma once
// The source tree as text, for tests of rules that every file keeps.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace rcs {

/// The root of the source tree, from RCS_SOURCE_DIR.
[[nodiscard]] std::filesystem::path source_root();

/// False for the folders of version control, builds and runs.
[[nodiscard]] bool is_source_folder(std::string_view top_level_name);

/// Calls `visit` with each .h and .cpp file: its path relative to `root`, and its text.
void for_each_source(
    const std::filesystem::path& root,
    const std::function<void(const std::string& path, const std::string& text)>& visit);

/// The code of a C++ file with comments and the contents of literals blanked (lines are kept), so
/// that neither samples in a test nor a comment about a clock count. The name of an #include stays.
[[nodiscard]] std::string code_of(std::string_view text);

}  // namespace rcs
