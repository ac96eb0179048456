#pragma once
// The folder of a recording as the recorder accesses it: files that are written at their end only.
// An interface, so that tests can keep only what was synced, fill the disk at any write, and delay
// each call. Numbers of errors are those of errno; 0 is success.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace rcs::recorder {

class AppendFile {
 public:
  AppendFile() = default;
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;
  virtual ~AppendFile() = default;

  /// @param written  number of bytes appended, possibly fewer than `size`
  /// @return error
  [[nodiscard]] virtual int append(const std::uint8_t* data, std::size_t size,
                                   std::size_t* written) = 0;
  /// Returns when all bytes so far are on the disk. @return error
  [[nodiscard]] virtual int sync() = 0;
};

struct FolderEntry {
  std::string name;
  std::int64_t bytes = 0;
};

class Folder {
 public:
  Folder() = default;
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  virtual ~Folder() = default;

  /// The regular files, in any order. @return error
  [[nodiscard]] virtual int list(std::vector<FolderEntry>* entries) = 0;
  /// An existing file is an error (EEXIST): nothing is overwritten. @return error
  [[nodiscard]] virtual int create(const std::string& name, std::unique_ptr<AppendFile>* file) = 0;
  /// @return error
  [[nodiscard]] virtual int remove(const std::string& name) = 0;
  /// Returns when the names of the created files are on the disk. @return error
  [[nodiscard]] virtual int sync() = 0;
  /// Space for the files of this user.
  [[nodiscard]] virtual std::int64_t free_bytes() = 0;
};

}  // namespace rcs::recorder
