// A drive of ten hours.
#include <gtest/gtest.h>

#include "tests/wm/long_drive.h"

namespace rcs::wm {
namespace {

TEST(CovarianceSlow, StaysSymmetricAndPositiveForTenHours) {
  expect_covariance_stays_sound(10.0 * 3600.0, 1000);
}

}  // namespace
}  // namespace rcs::wm
