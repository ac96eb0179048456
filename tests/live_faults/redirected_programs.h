#pragma once
// The programs of the build in a folder of their own, in which the output of some goes elsewhere:
// into a pipe that nobody reads, or into a file on a full disk.

#include <filesystem>
#include <string>

namespace rcs::live_faults {

class RedirectedPrograms {
 public:
  /// Sets RCS_BIN_DIR to `folder`, which must not exist, for what is started afterwards.
  explicit RedirectedPrograms(std::filesystem::path folder);
  RedirectedPrograms(const RedirectedPrograms&) = delete;
  RedirectedPrograms& operator=(const RedirectedPrograms&) = delete;
  ~RedirectedPrograms();  ///< sets RCS_BIN_DIR back

  /// From now on stdout and stderr of a node, or of `rcs up`, are appended to `file`; those of a
  /// check of the configuration are not.
  /// @param program  "up" or a node
  void redirect(const std::string& program, const std::filesystem::path& file) const;

 private:
  std::filesystem::path folder_;
  std::filesystem::path build_;
};

}  // namespace rcs::live_faults
