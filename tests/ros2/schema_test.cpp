// Schema texts, names of types and topics.

#include "rcs/ros2/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>

#include "tests/ros2/all_types.h"
#include "tests/support/source_code.h"

namespace rcs::ros2 {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(Schema, HasTheDependenciesBehindTheMessage) {
  const std::string line(80, '=');
  const Schema& s = schema_of<msg::PoseWithCovarianceStamped>();
  EXPECT_EQ(s.name, "geometry_msgs/msg/PoseWithCovarianceStamped");
  EXPECT_THAT(s.text, StartsWith("std_msgs/Header header\n"
                                 "geometry_msgs/PoseWithCovariance pose\n" +
                                 line + "\nMSG: "));
  for (const char* part :
       {"MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n",
        "MSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n",
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"}) {
    EXPECT_THAT(s.text, HasSubstr(line + "\n" + part));
  }
  EXPECT_THAT(schema_of<msg::PointCloud2>().text,
              HasSubstr("sensor_msgs/PointField[] fields\nbool is_bigendian\n"));
  EXPECT_THAT(schema_of<msg::DiagnosticArray>().text, HasSubstr("\nbyte level\n"));
}

TEST(Schema, OurTypesHaveTheirConstants) {
  const Schema& s = schema_of<nav_state_t>();
  EXPECT_EQ(s.name, "rcs_msgs/msg/NavState");
  EXPECT_THAT(s.text, HasSubstr("int8 MODE_LOST=7\n"));
  EXPECT_THAT(s.text, HasSubstr("float64[36] cov_world_pose\n"));
  EXPECT_THAT(s.text, HasSubstr("rcs_msgs/LatencyTrace latency_trace\n"));
  EXPECT_THAT(schema_of<map_patch_t>().text, HasSubstr("uint8[] slope_deg\n"));
  EXPECT_EQ(camel_case("gps_fix_t"), "GpsFix");
}

TEST(Schema, NamesAreValidInRos2) {
  const std::regex field("[a-z]([a-z0-9]*)(_[a-z0-9]+)*");
  const std::regex type("[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*");
  const std::regex constant("[A-Z]([A-Z0-9_]*[A-Z0-9])?");
  std::vector<TypeDescription> types;
  test::for_each_type([&types](const auto* t) {
    describe<std::remove_const_t<std::remove_pointer_t<decltype(t)>>>(&types);
  });
  EXPECT_GT(types.size(), 60U);
  for (const TypeDescription& t : types) {
    EXPECT_TRUE(std::regex_match(t.name, type)) << t.name;
    EXPECT_FALSE(t.fields.empty()) << t.name;
    for (const FieldDescription& f : t.fields) {
      EXPECT_TRUE(std::regex_match(f.name, field)) << t.name << "." << f.name;
    }
    for (const ConstantDescription& c : t.constants) {
      EXPECT_TRUE(std::regex_match(c.name, constant)) << t.name << "." << c.name;
    }
  }
}

template <class T>
std::string type_of(const Topic<T>& /*topic*/) {
  return type_name<T>();
}

TEST(Topics, AreInTheUserPageWithTheirTypes) {
  std::ifstream in(source_root() / "docs/user/other_tools.md");
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  std::set<std::string> names;
  for_each_topic([&](const auto& topic) {
    const std::string name = topic.name;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_EQ(name.front(), '/');
    EXPECT_THAT(page, HasSubstr("| `" + name + "` | " + type_of(topic) + " |")) << name;
  });
}

}  // namespace
}  // namespace rcs::ros2
