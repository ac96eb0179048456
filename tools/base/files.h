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

/// Remembers a file that the command reads (by device and inode, so that links and other spellings
/// of its path are the same file): OutputFile never replaces it. read_text() and read_bytes()
/// remember what they read; of the command line, main() remembers all that is no output.
void note_input(const std::string& path);

/// An error if `path` is a file or folder that note_input() has seen, or lies in the folder of an a
/// priori map: a file there may be the map's own.
[[nodiscard]] Outcome check_output(const std::string& path);

/// SIGINT, SIGTERM and SIGHUP remove the temporaries of all OutputFiles before they end the
/// process. Once, at the start of main().
void remove_temporaries_when_killed();

/// A file that appears whole or not at all: written under write_path(), a temporary beside it,
/// which commit() moves to its name. Without commit() the temporary is removed and what was there
/// stays. A device or FIFO is written in place and never replaced; a symbolic link stays one.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& write_path() const { return write_path_; }
  /// A device or a FIFO: cannot be read back, and has no files beside it.
  [[nodiscard]] bool in_place() const { return in_place_; }
  [[nodiscard]] Outcome write(std::string_view text) const;
  /// Before long work: an error when the path names a folder, or when check_output() has one.
  [[nodiscard]] Outcome check() const;
  /// An error when check() has one.
  [[nodiscard]] Outcome commit() const;

 private:
  std::string path_;
  std::string target_;  ///< path_ without symbolic links
  std::string write_path_;
  bool in_place_ = false;
};

/// Creates the folders on the way.
Outcome write_text(const std::string& path, std::string_view text);

}  // namespace rcs::tools
