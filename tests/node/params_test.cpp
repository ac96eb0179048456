#include "rcs/node/params/params.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>
#include <functional>

namespace rcs {
namespace {

/// The error of reading `text` by `read`, or "" when there is none.
std::string error_of(const std::string& text, const std::function<void(ParamTable)>& read,
                     const std::vector<std::string>& others = {}) {
  const Result<ParamFile> file = ParamFile::parse(text, "file.toml");
  if (!file) return file.error().message;
  read(file->root());
  const Outcome finished = file->finish(others);
  return finished ? "" : finished.error().message;
}

std::string error_of_gate(const std::string& value) {
  return error_of("[sp.icp]\n\ngate_m = " + value + "\n", [](ParamTable root) {
    double gate_m = 1.0;
    root.table("sp").table("icp").get("gate_m", &gate_m, {0.1, 10.0});
  });
}

TEST(Params, ReadsEveryKind) {
  const Result<ParamFile> file = ParamFile::parse(R"(
a_m = 2
n = 3
big = 5000000000
on = true
name = "x"
kind = "point"
v = [1, 2.5, -3]
period_ms = 20
angle_deg = 180
mount_m = [1, 2, 3]
mount_rpy_deg = [0, 0, 90]
[inner]
b = 0.5
[[step]]
s = 1
[[step]]
s = 2
)",
                                                  "file.toml");
  ASSERT_TRUE(file.ok()) << file.error().message;
  ParamTable root = file->root();
  double a_m = 0.0;
  double angle_rad = 0.0;
  double b = 0.0;
  double kept = 7.0;
  int n = 0;
  std::int64_t big = 0;
  bool on = false;
  std::string name;
  std::string kind;
  Vec3 v;
  Duration period{};
  Pose mount;
  root.get("a_m", &a_m, {0, 10});
  root.get("n", &n, {0, 10});
  root.get("big", &big, {0, 1e10});
  root.get("on", &on);
  root.get("name", &name);
  root.get("kind", &kind, {"point", "plane"});
  root.get("v", &v, {-10, 10});
  root.get_ms("period_ms", &period, {1, 1000});
  root.get_deg("angle_deg", &angle_rad, {-180, 180});
  root.get_pose("mount", &mount, {-10, 10});
  root.table("inner").get("b", &b, {0, 1});
  root.table("absent").get("c", &kept, {0, 1});
  std::vector<int> steps;
  for (ParamTable step : root.tables("step")) {
    steps.push_back(0);
    step.get("s", &steps.back(), {0, 9});
  }
  ASSERT_TRUE(file->finish({}).ok()) << file->finish({}).error().message;
  EXPECT_EQ(a_m, 2.0);
  EXPECT_EQ(n, 3);
  EXPECT_EQ(big, 5'000'000'000);
  EXPECT_TRUE(on);
  EXPECT_EQ(name, "x");
  EXPECT_EQ(kind, "point");
  EXPECT_EQ(v, Vec3(1, 2.5, -3));
  EXPECT_EQ(period, Duration(20'000));
  EXPECT_DOUBLE_EQ(angle_rad, kPi);
  EXPECT_LT((mount * Vec3(1, 0, 0) - Vec3(1, 3, 3)).norm(), 1e-12);
  EXPECT_EQ(b, 0.5);
  EXPECT_EQ(kept, 7.0) << "a missing key keeps the default";
  EXPECT_EQ(steps, (std::vector<int>{1, 2}));
  EXPECT_TRUE(root.has("a_m"));
  EXPECT_FALSE(root.has("absent"));
}

TEST(Params, RollPitchYawIsRzRyRx) {
  const Result<ParamFile> file = ParamFile::parse("m_rpy_deg = [10, 20, 30]", "f");
  Pose pose;
  file->root().get_pose("m", &pose, {-1, 1});
  const auto rotation = [](double deg, const Vec3& axis) {
    return exp_so3(radians(deg) * axis).toRotationMatrix();
  };
  const Mat3 expected =
      rotation(30, Vec3::UnitZ()) * rotation(20, Vec3::UnitY()) * rotation(10, Vec3::UnitX());
  EXPECT_LT((pose.rotation() - expected).norm(), 1e-12);
}

TEST(Params, AnOutOfRangeErrorNamesFileLineTableKeyValueRangeAndUnit) {
  EXPECT_EQ(error_of_gate("99"), "file.toml:3: [sp.icp] gate_m = 99: not in [0.1, 10] (m)");
  EXPECT_EQ(error_of_gate("-0.5"), "file.toml:3: [sp.icp] gate_m = -0.5: not in [0.1, 10] (m)");
  EXPECT_EQ(error_of_gate("10.0"), "") << "both ends are allowed";
}

TEST(Params, NotANumberIsRejected) {
  EXPECT_EQ(error_of_gate("nan"), "file.toml:3: [sp.icp] gate_m = nan: not finite");
  EXPECT_EQ(error_of_gate("-inf"), "file.toml:3: [sp.icp] gate_m = -inf: not finite");
  EXPECT_EQ(error_of_gate("\"1\""), "file.toml:3: [sp.icp] gate_m = '1': not a number");
  EXPECT_EQ(error_of_gate("true"), "file.toml:3: [sp.icp] gate_m = true: not a number");
}

TEST(Params, WrongTypesAreRejected) {
  const auto error = [](const std::string& value, const std::function<void(ParamTable)>& read) {
    return error_of("k = " + value, read);
  };
  int n = 5;
  bool on = false;
  std::string s = "default";
  Vec3 v = Vec3::Zero();
  EXPECT_EQ(error("1.0",
                  [&](ParamTable t) {
                    t.get("k", &n, {0, 9});
                  }),
            "file.toml:1: k = 1.0: not a whole number");
  EXPECT_EQ(error("99999999999",
                  [&](ParamTable t) {
                    t.get("k", &n, {0, 9});
                  }),
            "file.toml:1: k = 99999999999: not in [0, 9]");
  EXPECT_EQ(error("1", [&](ParamTable t) { t.get("k", &on); }),
            "file.toml:1: k = 1: not true or false");
  EXPECT_EQ(error("1", [&](ParamTable t) { t.get("k", &s); }), "file.toml:1: k = 1: not a string");
  EXPECT_EQ(error("'c'",
                  [&](ParamTable t) {
                    t.get("k", &s, {"a", "b"});
                  }),
            "file.toml:1: k = 'c': not one of a, b");
  EXPECT_EQ(error("[1, 2]",
                  [&](ParamTable t) {
                    t.get("k", &v, {0, 9});
                  }),
            "file.toml:1: k = [ 1, 2 ]: not an array of three numbers");
  EXPECT_EQ(error("[1, 2, 10]",
                  [&](ParamTable t) {
                    t.get("k", &v, {0, 9});
                  }),
            "file.toml:1: k = 10: not in [0, 9]");
  EXPECT_EQ(error("1", [&](ParamTable t) { (void)t.table("k"); }),
            "file.toml:1: k = 1: not a table");
  EXPECT_EQ(error("1", [&](ParamTable t) { (void)t.tables("k"); }),
            "file.toml:1: k = 1: not an array of tables: write [[k]]");
  EXPECT_EQ(n, 5);
  EXPECT_EQ(s, "default");
  EXPECT_EQ(v, Vec3::Zero());
}

TEST(Params, AnUnknownKeyNamesTheNearestKnownOne) {
  const auto read = [](ParamTable root) {
    ParamTable icp = root.table("icp");
    double d = 0.0;
    icp.get("max_distance_m", &d, {0, 1});
    icp.get("gate_m", &d, {0, 1});
  };
  EXPECT_EQ(error_of("[icp]\ngate_m = 0.5\nmax_distnace_m = 1\n", read),
            "file.toml:3: [icp] unknown key max_distnace_m; did you mean max_distance_m?");
  EXPECT_EQ(error_of("[icp]\nsomething = 1\n", read), "file.toml:2: [icp] unknown key something");
  EXPECT_EQ(error_of("[ipc]\ngate_m = 0.5\n", read),
            "file.toml:1: unknown table ipc; did you mean icp?");
  EXPECT_EQ(error_of("[icp]\n[other]\nx = 1\n", read, {"other"}), "");
}

TEST(Params, UnknownKeysAreFoundInEveryTableAndTheFirstInTheFileIsNamed) {
  const auto read = [](ParamTable root) {
    int s = 0;
    for (ParamTable step : root.tables("step")) step.get("s", &s, {0, 9});
  };
  EXPECT_EQ(error_of("[[step]]\ns = 1\n[[step]]\ns = 2\nt = 3\n[zz]\n", read),
            "file.toml:5: [step[1]] unknown key t");
}

TEST(Params, AViolatedRuleBetweenKeysNamesTheLine) {
  EXPECT_EQ(error_of("a = 1\nb = 2\n",
                     [](ParamTable t) {
                       int a = 0;
                       int b = 0;
                       t.get("a", &a, {0, 9});
                       t.get("b", &b, {0, 9});
                       if (b > a) t.fail("b", "must not exceed a");
                     }),
            "file.toml:2: b = 2: must not exceed a");
}

TEST(Params, ASyntaxErrorNamesTheLine) {
  const std::string error = error_of("a = 1\nb = = 2\n", [](ParamTable) {});
  EXPECT_EQ(error.substr(0, 12), "file.toml:2:");
  EXPECT_NE(error_of("a = 1\na = 2\n", [](ParamTable) {}), "");
}

TEST(Params, AParserAssertionIsReportedAsAnErrorWithItsLine) {
  for (const char* text :
       {"[~x]",    "[\u00e9]",  "[[~x]]", "[ ~x]",      "[~",      "[[",     "[.a]",
        "[a.~]",   "[a.",       "~x = 1", "\u00e9 = 1", "a.~ = 1", "a. = 1", "a = {~ = 1}",
        "a = [~]", "a = ~",     "[\x01]", "[\xff]",     "a = {",   "a = [",  "a = \"",
        "a = '''", "a = 1979-", "a = +",  "a = 0x"}) {
    const std::string error = error_of(std::string("b = 1\n") + text + "\n", [](ParamTable) {});
    EXPECT_EQ(error.substr(0, 10), "file.toml:") << text << ": " << error;
  }
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t k = 0; k < times; ++k) all += text;
  return all;
}

TEST(Params, NestingIsLimited) {
  const std::string key = repeated("a.", 400'000) + "a";
  for (const std::string& text :
       {key + " = 1", "[" + key + "]", "[[" + key + "]]", "b = {" + key + " = 1}",
        "b = [1, {" + key + " = 1}]",
        // A string of several lines may end with quotes of its own.
        "b = [\"\"\"x\"\"\"\", {" + key + " = 1}]", "b = ['''x''''', {" + key + " = 1}, '']",
        repeated("\"=\" . ", 100'000) + "a = 1"}) {
    EXPECT_EQ(error_of("b1 = 1\n" + text, [](ParamTable) {}),
              "file.toml:2: a key with more than 16 dots")
        << text.substr(0, 20);
  }
  for (const char* open : {"[", "{a = ", "[{a = "}) {
    EXPECT_NE(error_of("a = " + repeated(open, 100'000), [](ParamTable) {}), "") << open;
  }
  EXPECT_EQ(error_of(std::string(2'000'000, '#'), [](ParamTable) {}),
            "file.toml: more than 1048576 bytes");
  // Dots in values, strings and comments do not count as dots of a key.
  const std::string dots(40, '.');
  EXPECT_EQ(error_of("# " + dots + "\na = \"" + dots + "\"\nb = \"\"\"\n" + dots + "\"\"\"\nc = '" +
                         dots + "'\nd = [" + repeated("1.5, ", 40) + "]\ne = \"\"\"\"\"" + dots +
                         "\"\"\"\"\"\n",
                     [](ParamTable t) {
                       std::string text;
                       for (const char* k : {"a", "b", "c", "e"}) t.get(k, &text);
                     },
                     {"d"}),
            "");
}

TEST(Params, ALongValueInAnErrorIsTruncated) {
  const std::string error = error_of("a = \"" + std::string(5000, 'x') + "\"", [](ParamTable t) {
    int a = 0;
    t.get("a", &a, {0, 9});
  });
  EXPECT_LT(error.size(), 300U);
}

TEST(Params, AFifoIsRejectedWithoutWaiting) {
  const std::string path = testing::TempDir() + "params_test.fifo";
  (void)std::remove(path.c_str());
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(ParamFile::load(path).error().message, path + ": is not a regular file");
  (void)std::remove(path.c_str());
}

TEST(Params, AMissingFileIsReported) {
  EXPECT_EQ(ParamFile::load("/nonexistent/a.toml").error().message,
            "/nonexistent/a.toml: cannot open: No such file or directory");
  EXPECT_FALSE(ParamFile::load("/tmp").ok());
}

TEST(Params, AnOverrideReplacesOrAddsAKeyOfTheFile) {
  const std::string path = testing::TempDir() + "params_override_test.toml";
  std::ofstream(path) << "[icp]\ngate_m = 0.5\nsteps = 3\n";
  const auto error_of_load = [&](const std::vector<std::string>& overrides, double* gate_m,
                                 int* steps, bool* on) {
    const Result<ParamFile> file = ParamFile::load(path, overrides);
    if (!file) return file.error().message;
    ParamTable icp = file->root().table("icp");
    icp.get("gate_m", gate_m, {0, 1});
    icp.get("steps", steps, {0, 9});
    file->root().table("other").get("on", on);
    const Outcome finished = file->finish({});
    return finished ? std::string() : finished.error().message;
  };
  double gate_m = 0.0;
  int steps = 0;
  bool on = false;
  EXPECT_EQ(
      error_of_load({"icp.gate_m = 0.7", "other.on=true", "icp.gate_m=0.9"}, &gate_m, &steps, &on),
      "");
  EXPECT_EQ(gate_m, 0.9) << "the last override applies";
  EXPECT_EQ(steps, 3) << "other keys are unchanged";
  EXPECT_TRUE(on);
  EXPECT_EQ(error_of_load({"icp.gate_m=7"}, &gate_m, &steps, &on),
            "icp.gate_m=7:1: [icp] gate_m = 7: not in [0, 1] (m)");
  EXPECT_EQ(error_of_load({"icp.gait_m=0.7"}, &gate_m, &steps, &on),
            "icp.gait_m=0.7:1: [icp] unknown key gait_m; did you mean gate_m?");
  EXPECT_EQ(error_of_load({"icp.gate_m=="}, &gate_m, &steps, &on).substr(0, 14), "icp.gate_m==:1");
}

TEST(Params, PathsAreRelativeToTheFile) {
  const std::string path = testing::TempDir() + "params_test.toml";
  std::ofstream(path) << "";
  const Result<ParamFile> file = ParamFile::load(path);
  ASSERT_TRUE(file.ok()) << "an empty file is a file of defaults: " << file.error().message;
  EXPECT_EQ(file->resolve("maps/a.tile"), testing::TempDir() + "maps/a.tile");
  EXPECT_EQ(file->resolve("/maps/a.tile"), "/maps/a.tile");
}

// toml++ 3.3 has undefined behavior for such a character where it looks for white space.
TEST(Params, CharactersOutsideOfAsciiAreForQuotesAndComments) {
  const Result<ParamFile> bare = ParamFile::parse("a = 1\n[\u00e9]\n", "t.toml");
  ASSERT_FALSE(bare.ok());
  EXPECT_EQ(bare.error().message, "t.toml:2: a character outside of ASCII, not in quotes");
  EXPECT_TRUE(ParamFile::parse("name = \"caf\u00e9\"  # \u00e9\n", "t.toml").ok());
  EXPECT_TRUE(ParamFile::parse("\xEF\xBB\xBF"
                               "a = 1\n",
                               "t.toml")
                  .ok())
      << "byte order mark";
}

}  // namespace
}  // namespace rcs
