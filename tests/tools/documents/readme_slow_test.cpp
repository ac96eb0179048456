// The commands of README.md, including those that take minutes.

#include "tests/tools/documents/readme_fixture.h"

namespace rcs::test {
namespace {

TEST_F(Readme, EveryCommandRunsIncludingTheSlowOnes) {
  ASSERT_NO_FATAL_FAILURE(make_folder(125.0));
  run_all(true);
}

}  // namespace
}  // namespace rcs::test
