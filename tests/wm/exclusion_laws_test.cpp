// Laws of the exclusion of sources over drives with randomly drawn faults, two at once.
#include <gtest/gtest.h>

#include "tests/wm/exclusion_laws.h"

namespace rcs::wm {
namespace {

TEST(ExclusionLaws, HoldInDrivesWithRandomFaults) { expect_laws(1, 4); }

}  // namespace
}  // namespace rcs::wm
