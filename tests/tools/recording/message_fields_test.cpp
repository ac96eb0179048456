// Every channel of the table has a decoder, and every field of a message a column.

#include "tools/recording/message_fields.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "lcmtypes/channel_types.h"

namespace rcs::recording {
namespace {

template <class T>
std::vector<std::uint8_t> encoded(const T& m) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, m.getEncodedSize());
  return bytes;
}

TEST(Channels, EachHasAWriterATypeAndADecoder) {
  std::set<std::string> names;
  for (const channel::Info& c : channel::kAll) {
    EXPECT_TRUE(names.insert(c.name).second) << c.name << " is listed twice";
    EXPECT_TRUE(known_channel(c.name)) << c.name;
    EXPECT_TRUE(channel::with_type_of(c.name, [&](const auto* type) {
      EXPECT_EQ(std::string(c.type),
                std::string(std::remove_pointer_t<decltype(type)>::getTypeName()));
      const std::remove_const_t<std::remove_pointer_t<decltype(type)>> empty{};
      const auto fields = read_fields(c.name, encoded(empty));
      ASSERT_TRUE(fields.has_value()) << c.name;
      EXPECT_EQ(fields->front().first, "utime") << c.name;
      const auto head = read_head(c.name, encoded(empty));
      EXPECT_TRUE(head.has_value()) << c.name;
    }));
    // The prefix of an output is its writer; a sensor has no prefix.
    if (c.kind == channel::Kind::kSensor) continue;
    std::string name(c.name);
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char ch) { return static_cast<char>(std::tolower(ch)); });
    if (c.kind == channel::Kind::kCommand) continue;
    EXPECT_EQ(name.rfind(std::string(c.writer) + "_", 0), 0U) << c.name << " of " << c.writer;
  }
  EXPECT_FALSE(known_channel("WM_NAV"));
  EXPECT_EQ(channel::kSensors.size(), 5U);
  EXPECT_TRUE(channel::is_sensor("INS"));
  EXPECT_FALSE(channel::is_sensor("BG_DRIVE"));
}

TEST(MessageFields, ArraysAndNestedMessagesAreColumns) {
  nav_state_t m{};
  m.p_world_vehicle_m[1] = 2.5;
  m.cov_world_pose[5][0] = 1.5;
  const auto fields = read_fields(channel::kWmNavState, encoded(m));
  ASSERT_TRUE(fields.has_value());
  const auto value = [&](const char* name) {
    const auto it = std::find_if(fields->begin(), fields->end(),
                                 [&](const auto& field) { return field.first == name; });
    return it == fields->end() ? std::string("no column") : it->second;
  };
  EXPECT_EQ(value("p_world_vehicle_m_1"), "2.5");
  EXPECT_EQ(value("cov_world_pose_5_0"), "1.5");
  EXPECT_EQ(value("mode"), "0");
}

}  // namespace
}  // namespace rcs::recording
