#pragma once
// Every command of README.md and docs/user, in their order, in a folder like the project's.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <random>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/replay/real_data.h"
#include "tests/support/point_scenes.h"
#include "tests/support/rcs_command.h"
#include "tests/tools/documents/readme_commands.h"
#include "tests/tools/survey/las_file.h"

namespace rcs::test {

/// The lines of the ```sh blocks: continued lines joined, comments and blanks cut off.
inline std::vector<std::string> commands_of(const std::string& text) {
  std::vector<std::string> commands;
  std::istringstream lines(text);
  std::string line;
  std::string command;
  bool inside = false;
  while (std::getline(lines, line)) {
    if (line.compare(0, 3, "```") == 0) {
      inside = line == "```sh";
      continue;
    }
    if (!inside) continue;
    line = std::regex_replace(line, std::regex(" +# .*$"), "");
    const bool goes_on = !line.empty() && line.back() == '\\';
    command += goes_on ? line.substr(0, line.size() - 1) : line;
    if (goes_on) continue;
    command = std::regex_replace(command, std::regex("^ +| +$|( ) +"), "$1");
    if (!command.empty() && command.front() != '#') commands.push_back(command);
    command.clear();
  }
  return commands;
}

inline const ReadmeCommand* classified(const std::string& command) {
  for (const ReadmeCommand& c : kReadmeCommands) {
    if (command.compare(0, c.command.size(), c.command) == 0) return &c;
  }
  return nullptr;
}

/// The commands of rcs in code spans of the text, without those that name a placeholder.
inline std::set<std::string> inline_commands_of(const std::string& text) {
  static const std::regex kSpan("`(?:build/release/bin/)?(rcs [a-z][^`|]*)`");
  std::set<std::string> commands;
  for (std::sregex_iterator it(text.begin(), text.end(), kSpan), end; it != end; ++it) {
    commands.insert(std::regex_replace((*it)[1].str(), std::regex("\\s+"), " "));
  }
  return commands;
}

class Readme : public RcsCommand {
 protected:
  Readme() {
    // Pages of the maps before those that write another result.log.
    for (const char* page :
         {"README", "docs/user/getting_started", "docs/user/own_vehicle", "docs/user/maps",
          "docs/user/replay", "docs/user/other_tools", "docs/user/recording", "docs/user/viewer",
          "docs/user/commanding", "docs/user/vehicle_install", "docs/user/dds",
          "docs/user/ros2_bridge", "docs/user/drills_and_evaluation", "docs/user/coming_from"}) {
      const std::string text = text_of(variable("RCS_SOURCE_DIR") + "/" + page + ".md");
      EXPECT_FALSE(text.empty()) << page;
      const std::vector<std::string> commands = commands_of(text);
      commands_.insert(commands_.end(), commands.begin(), commands.end());
      inline_commands_.merge(inline_commands_of(text));
    }
  }

  int shell(const std::string& command) {
    std::ofstream(folder_ + "/command.sh")
        << "cd " << folder_ << "\nrcs=build/release/bin/rcs\nset -e\n"
        << command << "\n";
    const std::string line =
        "timeout 600 bash " + folder_ + "/command.sh >" + folder_ + "/said 2>&1 </dev/null";
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string said() const { return text_of(folder_ + "/said"); }

  void link_programs() const {
    std::filesystem::create_directories(folder_ + "/build/release");
    std::filesystem::create_directory_symlink(std::filesystem::absolute(variable("RCS_BIN_DIR")),
                                              folder_ + "/build/release/bin");
  }
  /// The files of a reader of README.md: the project, and files of their own.
  void make_folder(double drive_s) {
    const std::string source = variable("RCS_SOURCE_DIR");
    link_programs();
    for (const char* folder : {"tools", "docs", "lcmtypes"}) {
      std::filesystem::create_directory_symlink(std::filesystem::absolute(source) / folder,
                                                folder_ + "/" + folder);
    }
    std::filesystem::create_directory_symlink(
        std::filesystem::absolute(variable("RCS_BIN_DIR")).parent_path() / "lcmtypes",
        folder_ + "/build/release/lcmtypes");
    std::filesystem::copy(source + "/config", folder_ + "/config",
                          std::filesystem::copy_options::recursive);
    std::filesystem::copy_file(source + "/config/demo3.toml", folder_ + "/config/my_vehicle.toml");
    ASSERT_EQ(shell("$rcs sim config/sim/drill.toml --duration " + std::to_string(drive_s) +
                    " -o my_run.log --prior-map maps/course\n"
                    "ln my_run.log run.log\n"
                    "$rcs replay config/demo3.toml run.log -o result.log\n"
                    "mkdir recording && ln result.log recording/rcs-00000001-20261126T183404Z.log\n"
                    "mkdir -p out/d01 && cp result.log out/d01/d01_dropout_60s.log\n"
                    "$rcs map export maps/course --geotiff dem.tif\n"
                    "$rcs map import raster dem.tif --heights EGM96 --sigma 1 --date 2020-06-30 "
                    "-o maps/newer\n"
                    "printf 'x_m,y_m\\n-30,0\\n30,0\\n' >route.csv"),
              0)
        << said();
    make_drill();
    make_clouds();
    make_tiles();
    link_data(drive_s > 100.0);
  }

  void make_drill() const {
    std::ofstream(folder_ + "/my_drill.toml")
        << "name = \"GPS lost\"\nabout = \"For 20 s.\"\n[run]\nlength_s = 70\n[[stimulus]]\n"
           "kind = \"dropout\"\nsource = \"gps\"\nbegin_s = 35\nlength_s = 20\n[limits]\n"
           "missed_alerts = 0\n";
  }
  void make_clouds() const {
    std::mt19937 rng(3);
    const Vec3 here = Vec3::Zero();
    const Points model = test::scene(test::Ground::kRolling, true, 6000, 0.01, here, &rng);
    const Points other = test::scene(test::Ground::kRolling, true, 6000, 0.01, here, &rng);
    write_pcd("first.pcd", model);
    write_pcd("second.pcd", test::moved(test::pose(0.3, -0.2, 0.05, 0.0, 0.01, 0.03), other));
  }
  void write_pcd(const std::string& name, const Points& points) const {
    std::ofstream out(folder_ + "/" + name);
    out << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << points.size()
        << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << points.size() << "\nDATA ascii\n";
    for (std::size_t i = 0; i < points.size(); ++i) out << points[i].transpose() << "\n";
  }
  void make_tiles() const {
    LasFile las;
    std::string keys;  // GeoTIFF's: projected, EPSG 32632
    for (const int v : {1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32632}) {
      LasFile::put(keys.size(), static_cast<std::uint16_t>(v), &keys);
    }
    las.records = {{"LASF_Projection", 34735, keys}};
    for (int k = 0; k < 10000; ++k) {
      const int row = k / 100;
      const double x = 0.7 * (k % 100);
      const double y = 0.7 * row;
      las.points.push_back({500000.0 + x, 5200000.0 + y, 300.0 + 0.02 * x, 2, 1, 1, false});
    }
    std::filesystem::create_directory(folder_ + "/tiles");
    las.write(folder_ + "/tiles/one.las");
  }
  void link_data(bool sweeps) {
    const char* root = std::getenv("RCS_DATA_DIR");
    has_data_ = root != nullptr && std::filesystem::exists(std::string(root) + "/av2_pittsburgh");
    if (!has_data_) return;
    const std::string links =
        "ln -s $d/av2_pittsburgh/7fab2350* LOG_FOLDER\nln -s $d/gps_imu_comma2k19 .\n"
        "ln -s $d/gps_imu_husky/test1_*.csv $d/gps_imu_balzer82/2014-03*.csv .\n";
    const std::string ten_sweeps =
        "k=$d/kitti_2011_09_26_drive_0005\nmkdir -p velodyne_points/data\n"
        "tar xJf $k/velodyne_bin_000-079.tar.xz -C velodyne_points/data\n"
        "find velodyne_points/data -name '00000000[1-9]?.bin' -delete\n"
        "head -n 10 $k/poses/oxts_imu_poses_kitti.txt >poses.txt\nln -s $k/calib calib\n";
    ASSERT_EQ(shell("d=" + std::string(root) + "\n" + links + (sweeps ? ten_sweeps : "")), 0)
        << said();
  }

  /// Every option of the command is listed in the help of its program.
  void expect_options(const std::string& command) {
    std::istringstream words(command);
    std::string word;
    std::string program;
    words >> program;
    std::vector<std::string> options;
    std::string sub;
    bool named = program.find("rcs") == std::string::npos;
    while (words >> word) {
      if (word.size() > 1 && word[0] == '-' && std::isdigit(word[1]) == 0) {
        options.push_back(word.substr(0, word.find('=')));
        named = true;
      } else if (!named && word.find_first_of("./") == std::string::npos) {
        sub += " " + word;
        named = word != "map" && word != "log" && word != "import";
      } else {
        named = true;
      }
    }
    ASSERT_EQ(shell(program + sub + " --help"), 0) << command << "\n" << said();
    const std::string help = said();
    for (const std::string& option : options) {
      EXPECT_TRUE(std::regex_search(help, std::regex(option + "[ ,\n]")))
          << command << ": no option " << option;
    }
  }

  void run_all(bool slow) {
    for (const std::string& command : commands_) {
      const ReadmeCommand* c = classified(command);
      if (c != nullptr && c->how == How::kForeign) continue;
      if (c != nullptr && c->how == How::kOptions) {
        expect_options(command);
        continue;
      }
      if (c != nullptr && c->how == How::kData && !has_data_) continue;
      if (c != nullptr && c->how == How::kSlowData && !(slow && has_data_)) continue;
      if (c != nullptr && c->how == How::kSlow && !slow) {
        expect_options(command);
        continue;
      }
      EXPECT_EQ(shell(command), 0) << command << "\n" << said();
    }
    if (!has_data_) std::printf("NOT RUN: the commands on real data. Set RCS_DATA_DIR.\n");
  }

  std::vector<std::string> commands_;
  std::set<std::string> inline_commands_;
  bool has_data_ = false;
};

}  // namespace rcs::test
