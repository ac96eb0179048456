#pragma once
// Files as the sink of a Writer and the source of a Reader.

#include <memory>
#include <string>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "tools/mcap/mcap_reader.h"
#include "tools/mcap/mcap_writer.h"

namespace rcs::mcap {

/// Appends to a file. Errors name it, with the reason of the system.
class FileSink final : public ByteSink {
 public:
  /// Creates the file, or makes it empty.
  /// @param name  in errors; the file may be a temporary
  static Result<std::unique_ptr<FileSink>> create(const std::string& path, const std::string& name);
  Outcome append(const std::uint8_t* data, std::size_t size) override;
  Outcome close();

 private:
  FileSink(FileHandle file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}

  FileHandle file_;
  std::string name_;
};

/// Opens a regular file. Errors name it.
[[nodiscard]] Result<Reader> open_file(const std::string& path);

}  // namespace rcs::mcap
