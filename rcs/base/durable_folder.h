#pragma once
// Folders for files that must survive a power failure.

#include <string>
#include <system_error>

namespace rcs {

/// Creates the folder and those above it that are missing, and returns when they are on the disk: a
/// new folder survives a power failure only when the folder above lists it there.
[[nodiscard]] std::error_code make_durable_folder(const std::string& path);

/// Returns when the names of the files in the folder are on the disk.
[[nodiscard]] std::error_code sync_folder(const std::string& path);

}  // namespace rcs
