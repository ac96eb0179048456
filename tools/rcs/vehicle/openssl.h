#pragma once
// The openssl program, run without a shell.

#include <string>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::cli {

/// @return its standard output; an error with what it said if it fails
[[nodiscard]] Result<std::string> openssl_output(std::vector<std::string> args);

[[nodiscard]] Outcome run_openssl(std::vector<std::string> args);

}  // namespace rcs::cli
