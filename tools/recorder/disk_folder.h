#pragma once
// A folder of the file system.

#include <memory>
#include <string>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "tools/recorder/folder.h"

namespace rcs::recorder {

class DiskFolder final : public Folder {
 public:
  /// Creates missing folders. The folder is locked until the object is destroyed: two recorders in
  /// one folder would delete each other's files. Errors name the folder.
  static Result<std::unique_ptr<DiskFolder>> open(const std::string& path);

  [[nodiscard]] int list(std::vector<FolderEntry>* entries) override;
  [[nodiscard]] int create(const std::string& name, std::unique_ptr<AppendFile>* file) override;
  [[nodiscard]] int remove(const std::string& name) override;
  [[nodiscard]] int sync() override;
  [[nodiscard]] std::int64_t free_bytes() override;

 private:
  explicit DiskFolder(FileHandle folder) : folder_(std::move(folder)) {}

  FileHandle folder_;
};

}  // namespace rcs::recorder
