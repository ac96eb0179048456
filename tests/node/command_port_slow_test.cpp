// A million random sequences of the command protocol: `ctest -L slow -R CommandSlow`.

#include <gtest/gtest.h>

#include "tests/node/command_sequence.h"

namespace rcs::test {
namespace {

TEST(CommandSlow, TheProtocolHoldsOverAMillionRandomSequences) {
  for (unsigned seed = 1'000'000; seed < 2'000'000; ++seed) {
    run_sequence(seed, 40);
    if (HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

}  // namespace
}  // namespace rcs::test
