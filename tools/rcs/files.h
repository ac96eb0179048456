#pragma once
// Files of the tools: read whole, and written so that a stopped command leaves no half of one.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::tools {

[[nodiscard]] Result<std::string> read_text(const std::string& path);
[[nodiscard]] Result<std::vector<std::uint8_t>> read_bytes(const std::string& path);

/// A file that appears whole or not at all: written under temporary_path(), moved to its name by
/// commit(), removed when that was not reached.
class OutputFile {
 public:
  explicit OutputFile(std::string path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& temporary_path() const { return temporary_path_; }
  Outcome commit();

 private:
  std::string path_;
  std::string temporary_path_;
};

/// Creates the folders on the way.
Outcome write_text(const std::string& path, std::string_view text);

}  // namespace rcs::tools
