#include "modules/sp/scan/scan_assembler.h"

#include <gtest/gtest.h>

namespace rcs::sp {
namespace {

FacetId id(std::int64_t scan, int facet, int count = 4) {
  return {scan, from_utime(1'000'000 + 100'000 * scan), facet, count};
}

PointFacet one_point() {
  static const float kTen = 10.0F;
  PointFacet f;
  f.x_m = f.y_m = f.z_m = &kTen;
  f.n = 1;
  return f;
}

TEST(ScanAssembler, IsCompleteWhenEveryFacetArrivedInAnyOrder) {
  ScanAssembler a{LadarParams{}};
  for (const int facet : {2, 0, 3}) {
    EXPECT_EQ(a.add(id(7, facet), one_point()), FacetVerdict::kAdded);
    EXPECT_FALSE(a.complete());
  }
  EXPECT_EQ(a.add(id(7, 1), one_point()), FacetVerdict::kAdded);
  EXPECT_TRUE(a.complete());
  EXPECT_EQ(a.scan()->points.size(), 4U);
  EXPECT_EQ(a.count().returns, 4);
}

TEST(ScanAssembler, ALostFacetLosesOnlyItself) {
  ScanAssembler a{LadarParams{}};
  a.add(id(1, 0), one_point());
  a.add(id(1, 3), one_point());
  EXPECT_EQ(a.add(id(2, 0), one_point()), FacetVerdict::kNewScan);
  EXPECT_EQ(a.facets_missing(), 2);
  EXPECT_EQ(a.scan_id(), 1);
  a.release();
  EXPECT_EQ(a.add(id(2, 0), one_point()), FacetVerdict::kAdded);
  EXPECT_EQ(a.scan()->points.size(), 1U);
}

TEST(ScanAssembler, RepeatedAndLateFacetsAreReported) {
  ScanAssembler a{LadarParams{}};
  a.add(id(5, 0), one_point());
  EXPECT_EQ(a.add(id(5, 0), one_point()), FacetVerdict::kRepeated);
  EXPECT_EQ(a.add(id(4, 1), one_point()), FacetVerdict::kOld);
  a.release();
  EXPECT_EQ(a.add(id(5, 1), one_point()), FacetVerdict::kOld);
  EXPECT_EQ(a.scan()->points.size(), 1U);
}

TEST(ScanAssembler, ARestartedWriterIsFollowed) {
  ScanAssembler a{LadarParams{}};
  a.add(id(5000, 0), one_point());
  EXPECT_EQ(a.add(id(1, 0), one_point()), FacetVerdict::kNewScan);
  a.release();
  EXPECT_EQ(a.add(id(1, 0), one_point()), FacetVerdict::kAdded);
}

}  // namespace
}  // namespace rcs::sp
