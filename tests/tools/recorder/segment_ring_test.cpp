// The files of a ring: limits, names, former runs.

#include "tools/recorder/segment_ring.h"

#include <gmock/gmock.h>

#include "tests/tools/recorder/recorder_fixture.h"

namespace rcs::recorder {
namespace {

using test::batch_of;
using test::FaultyFolder;
using test::kEventBytes;
using test::read_back;

RingParams params(std::int64_t segment, std::int64_t segments) {
  return {"rcs-", ".log", segments * segment * kEventBytes, segment * kEventBytes, kMaxDuration};
}

void append(const Batch& batch, SegmentRing* ring) {
  BatchPosition at;
  ASSERT_EQ(ring->append(batch, &at), 0);
  ASSERT_EQ(at.record, batch.ends.size());
  ASSERT_EQ(ring->sync(), 0);
}

std::vector<std::string> names(const FaultyFolder& folder) {
  std::vector<std::string> names;
  for (const auto& [name, file] : folder.files) names.push_back(name);
  return names;
}

TEST(SegmentRing, TheSumNeverExceedsTheLimitAndTheOldestGoFirst) {
  for (const std::int64_t batch : {1, 3, 10, 25, 70}) {
    FaultyFolder folder;
    std::int64_t largest = 0;
    folder.at_every_instant = [&] { largest = std::max(largest, folder.bytes()); };
    SegmentRing ring(&folder, params(10, 5));
    ASSERT_EQ(ring.open(), 0);
    for (std::int64_t k = 0; k < 20; ++k) append(batch_of(batch * k, batch), &ring);
    EXPECT_LE(largest, 50 * kEventBytes) << batch;
    EXPECT_EQ(ring.bytes(), folder.bytes());
    const std::vector<std::int64_t> numbers = read_back(folder.files).numbers;
    EXPECT_TRUE(test::consecutive(numbers)) << batch;
    EXPECT_EQ(numbers.back(), 20 * batch - 1);
    EXPECT_GE(static_cast<std::int64_t>(numbers.size()), std::min<std::int64_t>(20 * batch, 40))
        << batch;
  }
}

TEST(SegmentRing, ASegmentHoldsWholeEventsAndEndsAtItsSizeOrDuration) {
  FaultyFolder folder;
  RingParams p = params(10, 100);
  p.segment_duration = from_milliseconds(25.0);
  SegmentRing ring(&folder, p);
  ASSERT_EQ(ring.open(), 0);
  for (int k = 0; k < 10; ++k) append(batch_of(8 * k, 8), &ring);  // 8 ms each
  for (const auto& [name, file] : folder.files) {
    EXPECT_EQ(static_cast<std::int64_t>(file.bytes.size()) % kEventBytes, 0) << name;
    EXPECT_LE(static_cast<std::int64_t>(file.bytes.size()), 10 * kEventBytes) << name;
  }
  EXPECT_GE(folder.files.size(), 8U);

  FaultyFolder slow;
  p.segment_bytes = 1000 * kEventBytes;
  SegmentRing long_ring(&slow, p);
  ASSERT_EQ(long_ring.open(), 0);
  for (int k = 0; k < 100; ++k) append(batch_of(k, 1), &long_ring);
  EXPECT_EQ(slow.files.size(), 4U) << "100 ms in segments of 25 ms";
}

TEST(SegmentRing, AnEventLargerThanASegmentIsStored) {
  FaultyFolder folder;
  SegmentRing ring(&folder, {"rcs-", ".log", 1'000'000, 50, kMaxDuration});
  ASSERT_EQ(ring.open(), 0);
  append(batch_of(0, 3), &ring);
  EXPECT_EQ(folder.files.size(), 3U);
}

TEST(SegmentRing, ALaterRunContinuesTheNumbersAndOverwritesNothing) {
  FaultyFolder folder;
  {
    SegmentRing ring(&folder, params(10, 4));
    ASSERT_EQ(ring.open(), 0);
    append(batch_of(0, 25), &ring);
  }
  EXPECT_THAT(names(folder), testing::ElementsAre("rcs-00000001-19700101T001640Z.log",
                                                  "rcs-00000002-19700101T001640Z.log",
                                                  "rcs-00000003-19700101T001640Z.log"));
  const FaultyFolder::Files first_run = folder.files;
  folder.files["rcs-note.log"] = {};  // files of others stay
  folder.files["00000009-x.log"] = {};
  SegmentRing ring(&folder, params(10, 4));
  ASSERT_EQ(ring.open(), 0);
  EXPECT_EQ(ring.bytes(), 25 * kEventBytes);
  // The wall clock stepped back between the runs: the order of the names does not depend on it.
  Batch batch = batch_of(25, 16);
  batch.stamp = from_utime(1'000'000);
  append(batch, &ring);
  EXPECT_THAT(
      names(folder),
      testing::ElementsAre("00000009-x.log", "rcs-00000002-19700101T001640Z.log",
                           "rcs-00000003-19700101T001640Z.log", "rcs-00000004-19700101T000001Z.log",
                           "rcs-00000005-19700101T000001Z.log", "rcs-note.log"));
  EXPECT_EQ(folder.files["rcs-00000003-19700101T001640Z.log"].bytes,
            first_run.at("rcs-00000003-19700101T001640Z.log").bytes);
}

}  // namespace
}  // namespace rcs::recorder
