// The rules of docs/design/architecture.md that keep the system simple, checked on the text of
// every source file: which folder may include which, which folder may use which library, where a
// clock may be read.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/source_code.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

// ---- the rules -----------------------------------------------------------------------------

/// A folder (a pattern of paths) and the project files that its files may include. The first
/// matching pattern applies. A folder may include only folders above it in this list, so that no
/// cycle can arise; the exceptions are the shells, which are listed before their cores because
/// their patterns are more specific.
struct Folder {
  const char* paths;
  const char* may_include;
  const char* name_space;
};
const Folder kFolders[] = {
    {"rcs/base/.*", "rcs/base/.*", "rcs"},
    {"rcs/terrain/.*", "rcs/(base|terrain)/.*", "rcs"},
    {"rcs/command_line/.*", "rcs/(base|command_line)/.*", "rcs::command_line"},
    {"lcmtypes/.*", "(rcs/base|lcmtypes)/.*", "rcs(::(channel|event))?"},
    {"rcs/node/.*", "(rcs/(base|command_line|node)|lcmtypes)/.*", "rcs"},
    {"rcs/prior/.*", "(rcs/(base|terrain|node|prior)|lcmtypes)/.*", "rcs"},
    {"rcs/zones/zone_(file|params)\\..*", "rcs/(base|node|zones)/.*", "rcs"},
    {"rcs/zones/.*", "rcs/(base/.*|zones/(zones|zone_raster|ring_check|capsule)\\.h)", "rcs"},
    {"rcs/cdr/.*", "rcs/(base|cdr)/.*", "rcs::cdr"},
    {"rcs/dds/.*", "rcs/(base|node|dds)/.*", "rcs::dds"},
    {"rcs/ros2/.*", "(rcs/(base|cdr|ros2)|lcmtypes)/.*", "rcs::ros2(::(msg|topic))?"},
    // Shells, then cores. Modules communicate by messages only; bg and mission may call vj, and sp
    // the registration library.
    {"modules/sp/(.*_node|.*_main|.*_config)\\..*",
     "(rcs|lcmtypes|modules/registration|modules/sp)/.*", "rcs::sp"},
    {"modules/wm/(.*_node|.*_main|.*_config)\\..*", "(rcs|lcmtypes|modules/wm)/.*", "rcs::wm"},
    {"modules/bg/(.*_node|.*_main|.*_config)\\..*", "(rcs|lcmtypes|modules/bg|modules/vj)/.*",
     "rcs::bg"},
    {"modules/mission/(.*_node|.*_main|.*_config)\\..*",
     "(rcs|lcmtypes|modules/mission|modules/vj)/.*", "rcs::mission"},
    {"modules/gateway/(command_arbiter|node_status_table|operator_commands)\\..*",
     "(rcs/base/.*|modules/gateway/(command_arbiter|node_status_table|operator_commands)\\.h)",
     "rcs::gateway"},
    {"modules/gateway/.*", "(rcs|lcmtypes|modules/gateway)/.*", "rcs::gateway"},
    {"modules/ros2_bridge/(input_gate|output_budget)\\..*",
     "(rcs/base/.*|rcs/node/bus/channel_owner\\.h|modules/ros2_bridge/"
     "(input_gate|output_budget)\\.h)",
     "rcs::ros2_bridge"},
    {"modules/ros2_bridge/.*", "(rcs/(base|node|cdr|dds|ros2)|lcmtypes|modules/ros2_bridge)/.*",
     "rcs::ros2_bridge"},
    {"modules/registration/.*", "(rcs/base|modules/registration)/.*", "rcs::registration"},
    {"modules/sp/.*", "(rcs/base|rcs/terrain|modules/registration|modules/sp)/.*", "rcs::sp"},
    {"modules/wm/.*", "(rcs/base|rcs/terrain|modules/wm)/.*", "rcs::wm"},
    {"modules/vj/.*", "(rcs/base|rcs/terrain|modules/vj)/.*", "rcs::vj"},
    {"modules/bg/.*",
     "((rcs/base|rcs/terrain|modules/bg|modules/vj)/.*|rcs/zones/(zones|zone_raster)\\.h)",
     "rcs::bg"},
    {"modules/mission/.*",
     "((rcs/base|rcs/terrain|modules/mission|modules/vj)/.*|rcs/zones/(zones|zone_raster)\\.h)",
     "rcs::mission"},
    {"sim/base/.*", "(rcs/base|sim/base)/.*", "rcs::sim"},
    {"sim/terrain/.*", "(rcs/base|rcs/terrain|sim/base|sim/terrain)/.*", "rcs::sim"},
    {"sim/vehicle/.*", "(rcs/base|sim/base|sim/terrain|sim/vehicle)/.*", "rcs::sim"},
    {"sim/actors/.*", "(rcs/base|sim/(base|terrain|vehicle|actors))/.*", "rcs::sim"},
    {"sim/sensors/.*", "(rcs/base|sim/(base|terrain|vehicle|actors|sensors))/.*", "rcs::sim"},
    {"sim/.*", "(rcs|lcmtypes|sim)/.*", "rcs::sim"},
    {"tools/base/.*", "(rcs/base|tools/base)/.*", "rcs::tools"},
    {"tools/report/.*", "(rcs/base|tools/(base|report))/.*", "rcs::report"},
    {"tools/clouds/.*", "(rcs/base|tools/(base|clouds))/.*", "rcs::clouds"},
    {"tools/recorder/.*", "(rcs/(base|node)|lcmtypes|tools/(base|report|recorder))/.*",
     "rcs::recorder"},
    {"tools/recording/.*",
     "(rcs/(base|node)|lcmtypes|modules/(registration|sp)|tools/(base|recording))/.*",
     "rcs::recording"},
    {"tools/mcap/.*",
     "(rcs/(base|cdr|ros2|node)|lcmtypes|modules/(registration|sp)|tools/(base|recording|mcap))/.*",
     "rcs::mcap"},
    {"tools/importers/.*", "(rcs/(base|node)|lcmtypes|tools/(base|recording|importers))/.*",
     "rcs::importers"},
    {"tools/evaluation/.*",
     "(rcs/(base|node)|lcmtypes|tools/(base|report|recording|evaluation))/.*", "rcs::evaluation"},
    {"tools/mapping/.*", "(rcs/(base|terrain)|tools/(base|recording|mapping))/.*", "rcs::mapping"},
    {"tools/survey/.*", "(rcs/(base|terrain)|tools/(base|clouds|mapping|survey))/.*",
     "rcs::survey"},
    {"tools/smoothing/.*",
     "(rcs|lcmtypes|modules/(registration|sp|wm)|"
     "tools/(base|report|recording|evaluation|smoothing))/.*",
     "rcs::smoothing"},
    {"tools/drills/.*",
     "(rcs|lcmtypes|modules/(registration|sp|wm)|sim|"
     "tools/(base|report|recording|evaluation|mapping|drills))/.*",
     "rcs::drills"},
    {"tools/driving/.*",
     "(rcs|lcmtypes|modules/(sp|wm|vj|bg|mission)|sim|tools/"
     "(base|report|evaluation|mapping|driving))/.*",
     "rcs::driving"},
    {"tools/studies/.*",
     "(rcs|lcmtypes|modules/(registration|sp|wm)|sim|"
     "tools/(base|report|clouds|recording|importers|evaluation|mapping|drills|studies))/.*",
     "rcs::studies"},
    {"tools/view/.*",
     "(rcs|lcmtypes|modules/(registration|sp)|"
     "tools/(base|clouds|recording|mcap|evaluation|studies|view))/.*",
     "rcs::view"},
    {"tools/rcs/.*", "(rcs|lcmtypes|modules|sim|tools)/.*", "rcs::cli"},
    {"tests/.*", "(rcs|lcmtypes|modules|sim|tools|tests)/.*", "rcs.*"},
};
constexpr char kProject[] = "(rcs|lcmtypes|modules|sim|tools|tests)/.*";
constexpr char kShell[] = "modules/.*_(node|main|config)\\..*";

/// Files that may have threads.
constexpr char kThreadsIn[] =
    "(rcs/prior/async_tile_loader|rcs/node/(stop_writer|bus/udpm_receiver|process/worker_thread)|"
    "modules/gateway/dds_link)\\..*|(tools|tests)/.*";

/// Text that only some files may contain. The pattern `what` is searched in the included name or in
/// the code.
struct Rule {
  const char* what;
  const char* only_in;
  const char* why;
};
const Rule kIncludeRules[] = {
    {"lcm/lcm.*", "(rcs/node/bus/lcm_bus|tests/node/lcm_interoperability_test)\\..*",
     "LCM itself belongs to rcs/node/bus/lcm_bus"},
    {"lcm/.*", "(rcs/node|tests/node)/.*", "LCM itself belongs to rcs/node"},
    {"toml.*", "rcs/node/params/params_state\\.h",
     "toml++ belongs to rcs/node/params/params_state.h"},
    {"GeographicLib/.*", "rcs/base/geodesy\\.cpp", "GeographicLib belongs to geodesy.cpp"},
    {"nanoflann.*", "rcs/base/kd_tree\\.h", "nanoflann belongs to rcs/base/kd_tree.h"},
    {"libqhull.*", "tests/bench/.*", "qhull belongs to a benchmark, and to no product"},
    {"dds/.*", "(rcs/dds|modules/gateway|modules/ros2_bridge|tests/ros2)/.*",
     "Cyclone DDS belongs to rcs/dds, the gateway and the bridge to ROS 2"},
    {"boost/.*", "(tools/view|tests/tools/view)/.*", "Boost belongs to the viewer"},
    {"zstd\\.h", "tools/mcap/compression\\.cpp", "zstd belongs to tools/mcap/compression.cpp"},
    {"(gdal|ogr|cpl)[a-z_0-9]*\\.h", "tools/survey/.*", "GDAL belongs to tools/survey"},
    {"CLI/.*", "((tools|rcs/command_line|tests/command_line)/.*|.*_(main|options)\\.cpp)",
     "command lines belong to rcs/command_line, tools and mains"},
    {"fmt/.*",
     "(rcs/(command_line|node|dds|zones/zone_file)|modules/.*_(node|main|config)\\.|modules/"
     "(gateway|ros2_bridge)/"
     "dds_link|sim|tools|tests).*",
     "text belongs to shells and tools; a core returns facts"},
    {"nlohmann/.*", "(tools|tests)/.*|rcs/zones/zone_file\\.cpp",
     "JSON is a format of tools, and of the file of zones"},
    {"(gtest|gmock|benchmark)/.*", "tests/.*", "test libraries belong to tests"},
    {"(thread|mutex|shared_mutex|condition_variable|future|pthread\\.h)", kThreadsIn,
     "one thread a process"},
};
/// Includes from outside the project that a module's core may use: std (without files, streams and
/// threads), Eigen, and the libraries that a rule above permits.
constexpr char kCoreLibraries[] = "(Eigen/.*|nanoflann\\.hpp|[a-z_0-9]+)";
constexpr char kNotInCores[] = "(cstdio|iostream|fstream|iomanip|filesystem|ctime|csignal|atomic)";

const Rule kCodeRules[] = {
    {"::now\\s*\\(\\s*\\)(?!\\s*(const|override))",
     "rcs/node/(timeline/live_timeline|budget)\\.cpp", "only a Timeline knows the time"},
    {"\\b(steady|system|high_resolution|file|utc|tai)_clock\\b|\\b(clock_gettime|gettimeofday|"
     "timespec_get|ftime|__rdtscp?)\\b|\\bstd::(time|clock)\\s*\\(",
     "rcs/node/(timeline/live_timeline|budget)\\.cpp",
     "a clock is read in live_timeline and budget only"},
    {"\\b(u|nano)?sleep\\s*\\(|\\bclock_nanosleep\\b|\\bsleep_(for|until)\\b", "tests/.*",
     "a node never sleeps; a Timeline waits"},
    {"\\bstd::(thread|jthread|async|mutex|condition_variable)\\b|\\bpthread_create\\b|#pragma omp",
     kThreadsIn, "one thread a process"},
    {"\\brand\\s*\\(\\s*\\)|\\brandom_device\\b|\\bsetRandom\\b|::Random\\s*\\(", "nowhere",
     "random numbers come from a seeded std::mt19937"},
    {"\\busing\\s+namespace\\b", "nowhere", "names are written out"},
    {R"(\bofstream\b|\bfopen\s*\(|\bstd::rename\s*\()",
     "(?!tools/).*|tools/base/files\\.cpp|tools/mapping/map_writer\\.cpp",
     "outputs of rcs are written by OutputFile (tools/base/files.h)"},
    {R"(\bf?printf\s*\(|\bstd::(cout|cerr|clog)\b|\bfmt::print\b)",
     "(?!modules/|rcs/|lcmtypes/).*|rcs/base/check\\.h|"
     "rcs/(command_line/parse|node/(report|process/(node_main|cycle_sinks)))\\.cpp",
     "a node reports by events (rcs/node/report.h)"},
};

const char* const kTopLevel[] = {".ci", "config", "docs",  "lcmtypes", "modules",
                                 "rcs", "sim",    "tests", "tools"};
// ---- the checker ---------------------------------------------------------------------------

/// Compiled once: constructing a regex costs more than using it.
bool matches(std::string_view text, const char* pattern) {
  static std::vector<std::pair<const char*, std::regex>> compiled;
  auto it = std::find_if(compiled.begin(), compiled.end(),
                         [&](const auto& entry) { return entry.first == pattern; });
  if (it == compiled.end()) {
    it = compiled.emplace(compiled.end(), pattern, std::regex(pattern));
  }
  return std::regex_match(text.begin(), text.end(), it->second);
}

struct Violation {
  std::string path;
  std::size_t line = 0;
  std::string what;
};

std::ostream& operator<<(std::ostream& out, const Violation& v) {
  return out << v.path << ":" << v.line << ": " << v.what;
}

/// Null: the architecture does not know the folder.
const Folder* folder_of(const std::string& path) {
  const auto* folder = std::find_if(std::begin(kFolders), std::end(kFolders),
                                    [&](const Folder& f) { return matches(path, f.paths); });
  return folder == std::end(kFolders) ? nullptr : folder;
}

/// The reason why the file at `path` must not include `name`; empty if the include is permitted.
std::string include_violation(const std::string& path, const std::string& name) {
  for (const Rule& rule : kIncludeRules) {
    if (matches(name, rule.what) && !matches(path, rule.only_in)) return rule.why;
  }
  const bool is_core =
      matches(path, "modules/(registration|sp|wm|vj|bg|mission)/.*") && !matches(path, kShell);
  if (!matches(name, kProject)) {
    if (is_core && (!matches(name, kCoreLibraries) || matches(name, kNotInCores))) {
      return "a core includes only std (no files, streams, threads), Eigen, rcs/base, "
             "rcs/terrain and its own folder";
    }
    return "";
  }
  if (is_core && matches(name, kShell)) return "a core must not know its shell";
  const Folder* folder = folder_of(path);
  if (folder == nullptr) return "";  // reported once for the file
  return matches(name, folder->may_include)
             ? ""
             : "may include only " + std::string(folder->may_include);
}

/// Every violation of the rules in one file. Pure: `text` is the file's content, `path` its path
/// relative to the root of the tree.
std::vector<Violation> violations(const std::string& path, std::string_view text) {
  std::vector<Violation> found;
  const Folder* folder = folder_of(path);
  if (folder == nullptr) {
    found.push_back({path, 1, "a file in a folder that the architecture does not know"});
  }
  static const std::regex name_space(R"re(^namespace (rcs[a-z_:0-9]*) \{)re");
  static const std::regex include(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"])re");
  static const std::vector<std::regex> code_rules = [] {
    std::vector<std::regex> compiled;
    for (const Rule& rule : kCodeRules) compiled.emplace_back(rule.what, std::regex::optimize);
    return compiled;
  }();
  std::istringstream code(code_of(text));
  std::string line;
  for (std::size_t number = 1; std::getline(code, line); ++number) {
    std::smatch match;
    if (std::regex_search(line, match, include)) {
      const std::string why = include_violation(path, match[1]);
      if (!why.empty()) found.push_back({path, number, "includes " + match[1].str() + ": " + why});
      continue;
    }
    if (std::regex_search(line, match, name_space) && folder != nullptr &&
        !matches(match[1].str(), folder->name_space)) {
      found.push_back({path, number, match[1].str() + ": this folder is " + folder->name_space});
    }
    for (std::size_t i = 0; i < code_rules.size(); ++i) {
      const Rule& rule = kCodeRules[i];
      if (std::regex_search(line, match, code_rules[i]) && !matches(path, rule.only_in)) {
        found.push_back({path, number, match[0].str() + ": " + rule.why});
      }
    }
  }
  return found;
}

bool is_top_level(const std::string& directory) {
  return !is_source_folder(directory) ||
         std::find(std::begin(kTopLevel), std::end(kTopLevel), directory) != std::end(kTopLevel);
}

// ---- tests of the checker -----------------------------------------------------------------

TEST(ArchitectureRules, CoreIncludesOnlyBaseTerrainAndItsOwnFolder) {
  const char core[] = "modules/sp/prior/prior_match.cpp";
  EXPECT_THAT(violations(core,
                         "#include <Eigen/Core>\n#include <vector>\n"
                         "#include \"rcs/base/pose.h\"\n#include \"rcs/terrain/tile.h\"\n"
                         "#include \"modules/sp/scan/scan.h\"\n"),
              testing::IsEmpty());
  for (const char* name :
       {"\"lcm/lcm.h\"", "<lcm/lcm-cpp.hpp>", "<toml++/toml.h>", "\"rcs/node/bus/bus.h\"",
        "\"lcmtypes/channels.h\"", "\"lcmtypes/rcs/points_t.hpp\"", "<fmt/format.h>", "<iostream>",
        "<thread>", "<unistd.h>", "<CLI/CLI.hpp>", "\"modules/sp/sp_node.h\""}) {
    EXPECT_EQ(violations(core, "#include " + std::string(name) + "\n").size(), 1U) << name;
  }
}

TEST(ArchitectureRules, ShellsMayUseTheBus) {
  for (const char* path : {"modules/sp/sp_node.cpp", "modules/sp/sp_node.h",
                           "modules/sp/sp_main.cpp", "modules/sp/sp_config.cpp"}) {
    EXPECT_THAT(violations(path,
                           "#include \"rcs/node/bus/inbox.h\"\n"
                           "#include \"lcmtypes/rcs/points_t.hpp\"\n"),
                testing::IsEmpty());
    EXPECT_EQ(violations(path, "#include <lcm/lcm.h>\n").size(), 1U) << path;
  }
}

TEST(ArchitectureRules, ModulesNeverIncludeEachOther) {
  const std::string sp = "#include \"modules/sp/scan/scan.h\"\n";
  const std::string vj = "#include \"modules/vj/traversal_cost.h\"\n";
  for (const char* path : {"modules/wm/eskf.cpp", "modules/wm/wm_node.cpp",
                           "modules/wm/wm_main.cpp", "modules/bg/search.cpp",
                           "modules/vj/traversal_cost.h", "modules/gateway/gateway_node.cpp"}) {
    EXPECT_EQ(violations(path, sp).size(), 1U) << path;
  }
  EXPECT_THAT(violations("modules/bg/search.cpp", vj), testing::IsEmpty());
  EXPECT_THAT(violations("modules/wm/eskf.cpp", vj), testing::SizeIs(1));
}

TEST(ArchitectureRules, LayersIncludeOnlyLowerLayers) {
  EXPECT_EQ(violations("rcs/base/pose.h", "#include \"rcs/node/node.h\"\n").size(), 1U);
  EXPECT_EQ(violations("rcs/node/node.h", "#include \"rcs/terrain/raster.h\"\n").size(), 1U);
  EXPECT_EQ(violations("modules/registration/gicp.h", "#include \"rcs/terrain/raster.h\"\n").size(),
            1U);
  EXPECT_EQ(
      violations("modules/registration/gicp.h", "#include \"modules/sp/scan/scan.h\"\n").size(),
      1U);
  EXPECT_EQ(violations("sim/terrain/world.h", "#include \"sim/sensors/gps.h\"\n").size(), 1U);
  EXPECT_EQ(violations("tools/report/table.h", "#include \"tools/recording/run_log.h\"\n").size(),
            1U);
  EXPECT_EQ(
      violations("tools/survey/map_export.h", "#include \"tools/drills/drill_run.h\"\n").size(),
      1U);
  EXPECT_EQ(violations("rcs/terrain/tile.h", "#include \"lcmtypes/convert.h\"\n").size(), 1U);
  EXPECT_EQ(violations("lcmtypes/convert.h", "#include \"rcs/terrain/tile.h\"\n").size(), 1U);
  EXPECT_EQ(violations("rcs/node/bus/bus.h", "#include \"modules/sp/scan/scan.h\"\n").size(), 1U);
  EXPECT_EQ(violations("modules/sp/sp_node.cpp", "#include \"tools/rcs/eval.h\"\n").size(), 1U);
  EXPECT_EQ(violations("rcs/common/text.h", "#include \"rcs/base/pose.h\"\n").size(), 1U);
}

TEST(ArchitectureRules, SimulatorIncludesNoModule) {
  EXPECT_EQ(violations("sim/sensors.cpp", "#include \"modules/sp/scan/range_image.h\"\n").size(),
            1U);
  EXPECT_EQ(violations("sim/sensors.cpp", "#include \"tests/support/scene.h\"\n").size(), 1U);
  EXPECT_THAT(violations("sim/sensors.cpp",
                         "#include \"rcs/node/bus/outbox.h\"\n"
                         "#include \"lcmtypes/channels.h\"\n"),
              testing::IsEmpty());
}

TEST(ArchitectureRules, NodesReportByEventsOnly) {
  for (const char* code : {"fprintf(stderr, \"x\");\n", "std::printf(\"x\");\n",
                           "std::cout << 1;\n", "fmt::print(\"x\");\n"}) {
    EXPECT_EQ(violations("modules/sp/sp_node.cpp", code).size(), 1U) << code;
    EXPECT_THAT(violations("tools/rcs/logs/log_command.cpp", code), testing::IsEmpty()) << code;
  }
  EXPECT_THAT(violations("modules/sp/sp_node.cpp", "std::snprintf(text, 9, \"x\");\n"),
              testing::IsEmpty());
}

TEST(ArchitectureRules, EveryFolderIsKnownAndHasItsNamespace) {
  EXPECT_EQ(violations("tools/helpers/a.cpp", "int a;\n").size(), 1U);
  EXPECT_EQ(violations("modules/wm/eskf.cpp", "namespace rcs::sp {\n").size(), 1U);
  EXPECT_THAT(violations("modules/wm/eskf.cpp", "namespace rcs::wm {\nnamespace fs = std::fs;\n"),
              testing::IsEmpty());
}

TEST(ArchitectureRules, EveryLibraryIsUsedByOneFolderOnly) {
  EXPECT_EQ(violations("tools/rcs/logs/log_command.cpp", "#include <lcm/lcm.h>\n").size(), 1U);
  EXPECT_EQ(violations("rcs/node/log/log_file.cpp", "#include <lcm/lcm.h>\n").size(), 1U);
  EXPECT_THAT(violations("rcs/node/bus/lcm_bus.cpp", "#include <lcm/lcm.h>\n"), testing::IsEmpty());
  EXPECT_EQ(violations("modules/sp/sp_config.cpp", "#include <toml++/toml.h>\n").size(), 1U);
  EXPECT_THAT(violations("rcs/node/params/params_state.h", "#include <toml++/toml.h>\n"),
              testing::IsEmpty());
  EXPECT_EQ(violations("modules/registration/point_to_plane_icp.cpp", "#include <nanoflann.hpp>\n")
                .size(),
            1U);
  EXPECT_THAT(violations("rcs/base/kd_tree.h", "#include <nanoflann.hpp>\n"), testing::IsEmpty());
  EXPECT_EQ(violations("sim/terrain/world.cpp", "#include <GeographicLib/Geocentric.hpp>\n").size(),
            1U);
  EXPECT_EQ(violations("rcs/terrain/tile.cpp", "#include <gdal_priv.h>\n").size(), 1U);
  EXPECT_EQ(violations("tools/mapping/merge.cpp", "#include <gdal_priv.h>\n").size(), 1U);
  EXPECT_THAT(violations("tools/survey/map_export.cpp", "#include <gdal_priv.h>\n"),
              testing::IsEmpty());
  EXPECT_EQ(violations("modules/bg/bg_node.cpp", "#include <dds/dds.h>\n").size(), 1U);
  EXPECT_EQ(violations("tools/rcs/cloud.cpp", "#include <libqhull_r/libqhull_r.h>\n").size(), 1U);
  EXPECT_EQ(violations("tools/mcap/a.cpp", "#include <boost/asio/io_context.hpp>\n").size(), 1U);
  EXPECT_THAT(violations("tools/view/a.cpp", "#include <boost/asio/io_context.hpp>\n"),
              testing::IsEmpty());
}

TEST(ArchitectureRules, ClocksAreReadInTheTimelineOnly) {
  for (const char* code :
       {"auto t = std::chrono::steady_clock::now();", "using C = std::chrono::system_clock;",
        "const auto t = Clock::now( );", "clock_gettime(CLOCK_MONOTONIC, &ts);",
        "std::time(nullptr)", "gettimeofday(&tv, nullptr);"}) {
    for (const char* path :
         {"modules/wm/eskf.cpp", "modules/wm/wm_node.cpp", "sim/terrain/world.cpp",
          "rcs/node/executor.cpp", "tools/rcs/replay.cpp"}) {
      EXPECT_FALSE(violations(path, code).empty()) << path << ": " << code;
    }
    EXPECT_THAT(violations("rcs/node/budget.cpp", code), testing::IsEmpty()) << code;
    EXPECT_THAT(violations("rcs/node/timeline/live_timeline.cpp", code), testing::IsEmpty())
        << code;
  }
  // A timeline's own now() and text in a comment or a literal do not count as reading a clock.
  EXPECT_THAT(violations("rcs/node/log_timeline.cpp",
                         "Stamp LogTimeline::now() const { return now_; }\n"
                         "// never std::chrono::steady_clock::now()\n"
                         "/* clock_gettime\n clock_gettime */ const char* s = \"system_clock\";\n"
                         "const int n = 1'000 + timeline.now().count();\n"),
              testing::IsEmpty());
}

TEST(ArchitectureRules, NoThreadsSleepOrUnseededRandomness) {
  EXPECT_EQ(violations("modules/registration/point_to_plane_icp.cpp", "std::thread worker;").size(),
            1U);
  EXPECT_EQ(violations("modules/sp/sp_node.cpp", "#include <thread>\n").size(), 1U);
  EXPECT_EQ(violations("rcs/node/executor.cpp", "usleep(1000);").size(), 1U);
  EXPECT_EQ(
      violations("tests/registration/point_to_plane_icp_test.cpp", "const int k = rand();").size(),
      1U);
  EXPECT_EQ(violations("sim/terrain/world.cpp", "Eigen::Vector3d::Random()").size(), 1U);
  EXPECT_THAT(
      violations("rcs/prior/async_tile_loader.cpp", "#include <thread>\nstd::thread worker_;"),
      testing::IsEmpty());
}

TEST(ArchitectureRules, OutputsAreWrittenByOutputFileOnly) {
  for (const char* code : {"std::ofstream out(path);", "std::FILE* f = std::fopen(p, \"w\");"}) {
    EXPECT_EQ(violations("tools/rcs/logs/eval_command.cpp", code).size(), 1U) << code;
    EXPECT_THAT(violations("tools/base/files.cpp", code), testing::IsEmpty()) << code;
    EXPECT_THAT(violations("tests/tools/vehicle/top_test.cpp", code), testing::IsEmpty()) << code;
  }
}

TEST(ArchitectureRules, ViolationsNameTheirLine) {
  const std::vector<Violation> found = violations(
      "modules/registration/point_to_plane_icp.cpp",
      "/* two\nlines */\n#include <lcm/lcm.h>\nconst char q = '\"';\nusing namespace std;\n");
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].line, 3U);
  EXPECT_EQ(found[1].line, 5U);
}

TEST(ArchitectureRules, TopLevelFoldersAreFixed) {
  EXPECT_TRUE(is_top_level("modules"));
  EXPECT_TRUE(is_top_level("build-debug"));
  EXPECT_FALSE(is_top_level("src"));
  EXPECT_FALSE(is_top_level("utils"));
}

// ---- the tree ------------------------------------------------------------------------------

TEST(Architecture, SourceTreeFollowsTheRules) {
  const fs::path root = source_root();
  for (const auto& top : fs::directory_iterator(root)) {
    const std::string name = top.path().filename().string();
    if (top.is_directory()) {
      EXPECT_TRUE(is_top_level(name)) << name << "/: not a folder of this project's layout";
    }
  }
  std::size_t files = 0;
  for_each_source(root, [&](const std::string& path, const std::string& text) {
    ++files;
    for (const Violation& v : violations(path, text)) ADD_FAILURE() << v;
  });
  EXPECT_GT(files, 10U) << "no sources under " << root;
}

TEST(Architecture, DocumentsNameOnlyFilesThatExist) {
  const fs::path root = source_root();
  const std::regex named("`([a-z]+/[A-Za-z0-9_/]+\\.(h|cpp|idl|cmake|sh))`");
  std::size_t files = 0;
  const std::regex linked(R"(\]\(([^)#:]+)[^):]*\))");
  std::vector<fs::path> documents;
  for (const char* name : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md"}) {
    documents.push_back(root / name);
  }
  for (const auto& entry : fs::recursive_directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") documents.push_back(entry.path());
  }
  for (const fs::path& document : documents) {
    std::ifstream in(document);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_FALSE(text.empty()) << document;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), named);
         it != std::sregex_iterator(); ++it) {
      ++files;
      EXPECT_TRUE(fs::exists(root / (*it)[1].str())) << document << " names " << (*it)[1];
    }
    for (auto it = std::sregex_iterator(text.begin(), text.end(), linked);
         it != std::sregex_iterator(); ++it) {
      EXPECT_TRUE(fs::exists(document.parent_path() / (*it)[1].str()))
          << document << " links to " << (*it)[1];
    }
  }
  EXPECT_GT(files, 40U);
}

}  // namespace
}  // namespace rcs
