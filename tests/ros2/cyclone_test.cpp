// The bytes equal those of Cyclone DDS, whose IDL compiler gets the IDL of the same types.

#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "rcs/cdr/cdr_message.h"
#include "ros2_types.h"
#include "tests/ros2/all_types.h"
#include "tests/support/random_message.h"

namespace rcs::ros2 {
namespace {

using Bytes = std::vector<std::uint8_t>;

const std::map<std::string, const dds_topic_descriptor_t*>& descriptors() {
  static const std::map<std::string, const dds_topic_descriptor_t*> kAll = {
#include "ros2_types.inc"
  };
  return kAll;
}

/// What the serializer of Cyclone reads of a type. Without a domain: the serializer needs no
/// entity.
ddsi_sertype_default sertype_of(const dds_topic_descriptor_t& d) {
  ddsi_sertype_default type{};
  type.type.size = d.m_size;
  type.type.align = d.m_align;
  type.type.flagset = d.m_flagset;
  type.type.ops.nops = dds_stream_countops(d.m_ops, d.m_nkeys, d.m_keys);
  type.type.ops.ops = const_cast<std::uint32_t*>(d.m_ops);
  type.opt_size_xcdr1 = dds_stream_check_optimize(&type.type, 1);
  return type;
}

/// XCDR1 of a sample in the memory layout of idlc, with the header of 4 bytes.
Bytes written_by_cyclone(const dds_topic_descriptor_t& d, const void* sample) {
  const ddsi_sertype_default type = sertype_of(d);
  dds_ostreamLE_t out;
  dds_ostreamLE_init(&out, 0, 1);
  EXPECT_TRUE(dds_stream_write_sampleLE(&out, sample, &type));
  Bytes bytes(cdr::kHeader.begin(), cdr::kHeader.end());
  bytes.insert(bytes.end(), out.x.m_buffer, out.x.m_buffer + out.x.m_index);
  dds_ostreamLE_fini(&out);
  return bytes;
}

/// The payload read by Cyclone, which checks it as it checks samples of the network, and written
/// again. Empty: rejected.
Bytes through_cyclone(const dds_topic_descriptor_t& d, const Bytes& payload) {
  const ddsi_sertype_default type = sertype_of(d);
  Bytes body(payload.begin() + cdr::kHeader.size(), payload.end());
  std::uint32_t actual = 0;
  if (!dds_stream_normalize(body.data(), static_cast<std::uint32_t>(body.size()), false, 1, &type,
                            false, &actual) ||
      actual != body.size()) {
    return {};
  }
  std::vector<std::uint64_t> sample((d.m_size + 7) / 8);
  dds_istream_t in;
  dds_istream_init(&in, static_cast<std::uint32_t>(body.size()), body.data(), 1);
  dds_stream_read_sample(&in, sample.data(), &type);
  Bytes out = written_by_cyclone(d, sample.data());
  dds_stream_free_sample(sample.data(), d.m_ops);
  return out;
}

TEST(Cyclone, ReadsAndWritesTheSameBytesForEveryType) {
  int types = 0;
  test::for_each_type([&types](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    ++types;
    const auto at = descriptors().find(type_name<T>());
    ASSERT_NE(at, descriptors().end()) << type_name<T>();
    Bytes ours;
    for (unsigned seed = 0; seed < 40; ++seed) {
      cdr::write_message(test::RandomMessage(seed).make<T>(), &ours);
      ASSERT_EQ(through_cyclone(*at->second, ours), ours) << type_name<T>() << ", seed " << seed;
    }
  });
  EXPECT_GT(types, 30);
}

TEST(Cyclone, AcceptsWhatIsReadOfADamagedPayload) {
  std::mt19937 random(1);
  int accepted = 0;
  int rejected = 0;
  test::for_each_type([&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    const dds_topic_descriptor_t& d = *descriptors().at(type_name<T>());
    Bytes ours;
    cdr::write_message(test::RandomMessage(7).make<T>(), &ours);
    for (int i = 0; i < 100; ++i) {
      const Bytes damaged = test::mutated(ours, &random);
      T message{};
      if (!cdr::read_message(damaged.data(), damaged.size(), &message)) {
        ++rejected;
        continue;
      }
      ++accepted;
      // The padding may be damaged: only what was read must be the same.
      Bytes again;
      cdr::write_message(message, &again);
      EXPECT_EQ(through_cyclone(d, again), again) << type_name<T>();
    }
  });
  EXPECT_GT(accepted, 100);
  EXPECT_GT(rejected, 100);
}

// Order and names of the fields: samples that are filled by name in C.

TEST(Cyclone, APoseWithCovarianceFilledByName) {
  geometry_msgs_msg_dds__PoseWithCovarianceStamped_ theirs{};
  theirs.header.stamp = {12, 34};
  char frame[] = "map";
  theirs.header.frame_id = frame;
  theirs.pose.pose.position = {1.0, 2.0, 3.0};
  theirs.pose.pose.orientation = {0.1, 0.2, 0.3, 0.9};
  theirs.pose.covariance[35] = 7.0;
  msg::PoseWithCovarianceStamped ours;
  ours.header = {{12, 34}, "map"};
  ours.pose.pose = {{1.0, 2.0, 3.0}, {0.1, 0.2, 0.3, 0.9}};
  ours.pose.covariance[35] = 7.0;
  Bytes bytes;
  cdr::write_message(ours, &bytes);
  EXPECT_EQ(written_by_cyclone(geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, &theirs),
            bytes);
}

TEST(Cyclone, APointCloudFilledByName) {
  sensor_msgs_msg_dds__PointCloud2_ theirs{};
  char frame[] = "ladar";
  char x[] = "x";
  theirs.header.frame_id = frame;
  theirs.height = 1;
  theirs.width = 2;
  sensor_msgs_msg_dds__PointField_ field = {x, 4, 7, 1};
  theirs.fields._buffer = &field;
  theirs.fields._length = theirs.fields._maximum = 1;
  theirs.point_step = 3;
  theirs.row_step = 6;
  std::uint8_t data[] = {1, 2, 3, 4, 5, 6};
  theirs.data._buffer = data;
  theirs.data._length = theirs.data._maximum = 6;
  theirs.is_dense = true;
  msg::PointCloud2 ours;
  ours.header.frame_id = "ladar";
  ours.height = 1;
  ours.width = 2;
  ours.point_fields = {{"x", 4, 7, 1}};
  ours.point_step = 3;
  ours.row_step = 6;
  ours.data = {1, 2, 3, 4, 5, 6};
  ours.is_dense = true;
  Bytes bytes;
  cdr::write_message(ours, &bytes);
  EXPECT_EQ(written_by_cyclone(sensor_msgs_msg_dds__PointCloud2__desc, &theirs), bytes);
}

TEST(Cyclone, ANavStateFilledByName) {
  rcs_msgs_msg_dds__NavState_ theirs{};
  nav_state_t ours{};
  theirs.utime = ours.utime = 123;
  theirs.mode = ours.mode = nav_state_t::MODE_LADAR;
  theirs.q_world_vehicle[1] = ours.q_world_vehicle[1] = 0.5;
  theirs.map_epoch = ours.map_epoch = -3;
  theirs.cov_world_pose[6 * 2 + 5] = ours.cov_world_pose[2][5] = 0.25;
  theirs.latency_trace.bg_start_utime = ours.latency_trace.bg_start_utime = 99;
  theirs.publish_utime = ours.publish_utime = 100;
  Bytes bytes;
  cdr::write_message(ours, &bytes);
  EXPECT_EQ(written_by_cyclone(rcs_msgs_msg_dds__NavState__desc, &theirs), bytes);
}

}  // namespace
}  // namespace rcs::ros2
