// The command line of the viewer, and pictures.

#include <gmock/gmock.h>

#include "tools/view/picture.h"
#include "tools/view/view_options.h"

namespace rcs::view {
namespace {

TEST(ViewOptions, ArgumentsGiveTheSameOptions) {
  ViewOptions options;
  options.log = "/proc/self/exe";  // a file that exists
  options.config = "/proc/self/exe";
  options.host = "0.0.0.0";
  options.port = 0;
  options.allowed_origins = {"https://a.example", "https://b.example"};
  options.shot = "t=97.5";
  options.panel = "3d";
  options.out = "-o.png";
  options.size = "640x480";
  options.dark = true;
  CLI::App app;
  ViewOptions parsed;
  add_view_options(&app, &parsed);
  std::vector<std::string> arguments = to_arguments(options);
  std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the end
  ASSERT_NO_THROW(app.parse(arguments));
  EXPECT_EQ(to_arguments(parsed), to_arguments(options));
  EXPECT_EQ(parsed.log, options.log);
  EXPECT_EQ(parsed.out, options.out);
  EXPECT_EQ(parsed.port, 0);
  EXPECT_TRUE(to_arguments(ViewOptions{}).empty());
}

TEST(ViewOptions, SizesAndMomentsAreChecked) {
  EXPECT_EQ(picture_size("640x480")->height, 480);
  for (const char* text :
       {"", "640", "640x", "x480", "640x480x", "0x480", "640x99999", "-640x480"}) {
    EXPECT_FALSE(picture_size(text)) << text;
  }
  ViewOptions options;
  options.log = "a.log";
  options.out = "a.png";
  for (const char* shot : {"t=97.5", "97.5", "0"}) {
    options.shot = shot;
    EXPECT_TRUE(check(options)) << shot;
  }
  EXPECT_EQ(shot_time_s(options), 0.0);
  for (const char* shot : {"t=", "t=-1", "t=nan", "t=1s", "noon"}) {
    options.shot = shot;
    EXPECT_FALSE(check(options)) << shot;
  }
}

TEST(Picture, DecodesBase64) {
  EXPECT_EQ(from_base64(""), "");
  EXPECT_EQ(from_base64("TQ=="), "M");
  EXPECT_EQ(from_base64("TWE="), "Ma");
  EXPECT_EQ(from_base64("TWFu"), "Man");
  EXPECT_EQ(from_base64("/+8A"), std::string("\xff\xef\0", 3));
  EXPECT_EQ(from_base64("TWF"), std::nullopt);
  EXPECT_EQ(from_base64("T!Fu"), std::nullopt);
}

}  // namespace
}  // namespace rcs::view
