#pragma once
// Where a fuzz target begins: `TARGET -seeds=DIRECTORY` writes its seed corpus and ends.

#include <functional>
#include <vector>

#include "tests/replay/hostile_drive.h"

namespace rcs::test {

/// From good messages, the first and the last of which differ most: alone, in a row, repeated, in
/// the wrong order, cut, and with a part of their bytes replaced.
[[nodiscard]] std::vector<Bytes> spoil(const std::vector<Bytes>& good);

/// For LLVMFuzzerInitialize; ends the process when seeds are asked for.
int write_seeds(int argc, char** argv, const std::function<std::vector<Bytes>()>& make);

}  // namespace rcs::test
