#pragma once
// Seed corpus of a fuzz target: `TARGET -seeds=DIRECTORY` writes it and exits.

#include <functional>
#include <vector>

#include "tests/replay/hostile_drive.h"

namespace rcs::test {

/// From valid messages, of which the first and the last differ most: single, in sequence, repeated,
/// in the wrong order, truncated, and with a part of their bytes replaced.
[[nodiscard]] std::vector<Bytes> spoil(const std::vector<Bytes>& good);

/// For LLVMFuzzerInitialize; exits the process if seeds are requested.
int write_seeds(int argc, char** argv, const std::function<std::vector<Bytes>()>& make);

}  // namespace rcs::test
