#pragma once
// The files of the page, which are part of the program: it needs no folder and no network.

#include <string_view>
#include <vector>

namespace rcs::view {

struct PageFile {
  std::string_view path;  ///< "/main.js"
  std::string_view type;  ///< MIME type
  std::string_view content;
};

/// Generated from tools/view/page.
[[nodiscard]] const std::vector<PageFile>& page_files();

/// @param path  "/" is "/index.html". nullptr: there is none
[[nodiscard]] const PageFile* find_page_file(std::string_view path);

}  // namespace rcs::view
