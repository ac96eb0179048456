#include "tools/view/server/page_files.h"

#include <algorithm>

namespace rcs::view {

const PageFile* find_page_file(std::string_view path) {
  const std::string_view wanted = path == "/" ? "/index.html" : path;
  const std::vector<PageFile>& files = page_files();
  const auto at = std::find_if(files.begin(), files.end(),
                               [&](const PageFile& file) { return file.path == wanted; });
  return at == files.end() ? nullptr : &*at;
}

}  // namespace rcs::view
