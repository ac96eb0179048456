#include "rcs/base/durable_folder.h"

#include <fcntl.h>

#include <cerrno>
#include <filesystem>
#include <vector>

#include "rcs/base/file_handle.h"

namespace rcs {

std::error_code make_durable_folder(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<std::string> above_new;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  for (fs::path p = whole; !fs::exists(p, error) && p.has_relative_path(); p = p.parent_path()) {
    above_new.push_back(p.parent_path().string());
  }
  fs::create_directories(whole, error);
  if (error) return error;
  for (const std::string& p : above_new) {
    if (const std::error_code unsynced = sync_folder(p); unsynced) return unsynced;
  }
  return {};
}

std::error_code sync_folder(const std::string& path) {
  const FileHandle folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.valid() && fsync(folder.get()) == 0) return {};
  return {errno, std::generic_category()};
}

}  // namespace rcs
