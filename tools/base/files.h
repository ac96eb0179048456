#pragma once
// Files of the tools: read whole, and written so that no input, device or complete file is lost.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::tools {

[[nodiscard]] Result<std::string> read_text(const std::string& path);
[[nodiscard]] Result<std::vector<std::uint8_t>> read_bytes(const std::string& path);

/// Records a file that the command reads (by device and inode, so that links and other spellings of
/// its path are the same file): OutputFile never replaces it. main() records all arguments of the
/// command line that are not outputs, and every input that is opened (rcs/base/input_files.h).
void note_input(const std::string& path);

/// An error if `path` was recorded by note_input(), or is in the folder of an a priori map, where
/// it may be a file of the map.
[[nodiscard]] Outcome check_output(const std::string& path);

/// SIGINT, SIGTERM (status kExitInterrupted, with a message) and SIGHUP remove the temporaries of
/// all OutputFiles before they end the process. Call it once, at the start of main().
void remove_temporaries_when_killed();

/// A file that is created completely or not at all: written to write_path(), a temporary next to
/// it, which commit() renames. Without commit() the temporary is removed and an existing file stays
/// unchanged. A device or FIFO is written in place; a symbolic link stays a link.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& write_path() const { return write_path_; }
  /// True for a device or a FIFO: it cannot be read back and has no accompanying files.
  [[nodiscard]] bool in_place() const { return in_place_; }
  [[nodiscard]] Outcome write(std::string_view text) const;
  /// Call it before long work: an error if the path is a folder, or from check_output().
  [[nodiscard]] Outcome check() const;
  /// Also returns the errors of check().
  [[nodiscard]] Outcome commit() const;

 private:
  std::string path_;
  std::string target_;  ///< path_ without symbolic links
  std::string write_path_;
  bool in_place_ = false;
};

/// Creates missing folders.
Outcome write_text(const std::string& path, std::string_view text);

}  // namespace rcs::tools
