// lcmtypes/events.h lists exactly the events that the nodes publish.

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>

#include "lcmtypes/events.h"
#include "tests/support/source_code.h"

namespace rcs {
namespace {

/// The publisher by the folder of the source; several for what these nodes use.
std::string publisher_of(const std::string& path) {
  static const std::pair<const char*, const char*> kFolders[] = {
      {"modules/sp/", "sp"},
      {"modules/wm/", "wm"},
      {"modules/bg/", "bg"},
      {"modules/mission/", "mission"},
      {"modules/gateway/", "gateway"},
      {"rcs/prior/", "sp, wm"},
      {"tools/rcs/vehicle/", "up"},
      {"tools/recorder/", "record"},
      {"modules/ros2_bridge/", "ros2_bridge"},
      {"rcs/node/process/", "sp, wm, bg, mission, gateway, ros2_bridge"}};
  for (const auto& [folder, node] : kFolders) {
    if (path.compare(0, std::string(folder).size(), folder) == 0) return node;
  }
  return "";
}

/// Names of the constants of the list, in its order.
std::vector<std::string> constant_names() {
#define RCS_EVENT_NAME(constant, ...) #constant,
  return {RCS_EVENTS(RCS_EVENT_NAME)};
#undef RCS_EVENT_NAME
}

TEST(Events, EveryListedEventIsPublishedByItsNodeAndNoOther) {
  std::map<std::string, std::set<std::string>> used;  // publishers by constant
  const std::regex constant("\\bevent::(k[A-Z]\\w*)");
  for_each_source(source_root(), [&](const std::string& path, const std::string& text) {
    const std::string code = code_of(text);
    if (path.compare(0, 6, "tests/") == 0) return;
    for (std::sregex_iterator m(code.begin(), code.end(), constant), end; m != end; ++m) {
      if ((*m)[1] != "kAll") used[(*m)[1]].insert(publisher_of(path));
    }
  });
  const std::vector<std::string> names = constant_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(used[names[i]], std::set<std::string>{event::kAll[i]->publisher})
        << names[i] << " (" << event::kAll[i]->code << ")";
  }
  EXPECT_EQ(used.size(), names.size());
}

TEST(Events, NoSourceMakesAnEventOutsideOfTheList) {
  const std::regex made("\\bevent::Info\\s+\\w+\\s*[{(=]|\\bInfo\\s+\\w+\\s*\\{");
  for_each_source(source_root(), [&](const std::string& path, const std::string& text) {
    if (path.compare(0, 6, "tests/") == 0 || path.compare(0, 9, "lcmtypes/") == 0) return;
    EXPECT_FALSE(std::regex_search(code_of(text), made)) << path;
  });
}

TEST(Events, EveryEventHasMeaningCauseAndRemedyAndItsOwnCode) {
  std::set<std::pair<std::string, std::string>> codes;
  for (const event::Info* e : event::kAll) {
    EXPECT_TRUE(codes.insert({e->publisher, e->code}).second) << e->code << " twice";
    EXPECT_TRUE(std::regex_match(e->code, std::regex("[a-z_]+(\\.[a-z_]+)?"))) << e->code;
    for (const std::string text : {e->meaning, e->cause, e->remedy}) {
      EXPECT_TRUE(text.size() > 4 && text.back() == '.') << e->code << ": " << text;
    }
  }
  EXPECT_GT(codes.size(), 50U);
}

}  // namespace
}  // namespace rcs
