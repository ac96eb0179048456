// The laws of the exclusion of sources over more than a million measurements.
#include <gtest/gtest.h>

#include "tests/wm/exclusion_laws.h"

namespace rcs::wm {
namespace {

TEST(ExclusionLawsSlow, HoldForAMillionMeasurements) { expect_laws(1001, 64); }

}  // namespace
}  // namespace rcs::wm
