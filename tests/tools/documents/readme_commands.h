#pragma once
// Handling of each command of README.md in the README test. A command that is not in this table
// runs; one that is in the table and no longer in README.md fails the test.

#include <array>
#include <string_view>

namespace rcs::test {

enum class How {
  kSlow,      ///< runs in the slow test
  kData,      ///< runs if the real data is available
  kSlowData,  ///< runs in the slow test if the real data is available
  kOptions,   ///< not run; its options must be listed in the program's --help
  kForeign,   ///< not run: another program, or a change of the system
};

struct ReadmeCommand {
  std::string_view command;  ///< its beginning
  How how;
  std::string_view why;
};

constexpr std::array<ReadmeCommand, 52> kReadmeCommands = {{
    {"./synthetic_vehicle", How::kForeign, "real time, on a bus; own_vehicle_test.sh"},
    {"PYTHONPATH=", How::kForeign, "real time, on a bus; own_vehicle_test.sh"},
    {"export", How::kForeign, "of the operator's shell; live_pages_test.sh"},
    {"$rcs map locate", How::kOptions, "a drive of 12 s is too short; locate tests in tests/sp"},
    {"tools/demo", How::kOptions, "four minutes in real time"},
    {"tools/test", How::kOptions, "runs this test"},
    {"build/release/bin/rcs up", How::kOptions, "runs until Ctrl-C; up_test.sh"},
    {"build/release/bin/rcs top", How::kOptions, "runs until q; live_pages_test.sh"},
    {"build/release/bin/rcs sim config/sim/demo.toml", How::kOptions, "206 s; sim tests"},
    {"lcm-logger", How::kForeign, "runs until Ctrl-C; live_pages_test.sh"},
    {"tools/setup --view", How::kForeign, "installs packages and builds"},
    {"build/release/bin/rcs view", How::kOptions, "runs until Ctrl-C; view_command_test.cpp"},
    {"build/release/bin/rcs record", How::kOptions, "runs until Ctrl-C; record_command_test.cpp"},
    {"build/release/bin/rcs log cut recording/ --around", How::kOptions,
     "the event does not occur; log_cut_command_test.cpp"},
    {"build/release/bin/rcs play", How::kOptions, "needs a bus; live_pages_test.sh"},
    {"lcm-logplayer", How::kForeign, "needs a bus; live_pages_test.sh"},
    {"build/release/bin/rcs table1", How::kSlow, "a minute"},
    {"unshare", How::kForeign, "an interactive shell"},
    {"build/release/bin/sim config/sim/closed_loop.toml", How::kOptions,
     "real time; live_pages_test.sh"},
    {"build/release/bin/rcs go", How::kOptions, "needs a vehicle; live_pages_test.sh"},
    {"$rcs map import av2", How::kData, ""},
    {"$rcs map study", How::kOptions, "minutes; map_study_test.cpp"},
    {"$rcs predict", How::kOptions, "needs a running wm; live_pages_test.sh"},
    {"$rcs map match", How::kOptions, "the pose is a placeholder"},
    {"build/release/bin/rcs drill --all", How::kOptions, "minutes; drill_all_test.cpp"},
    {"build/release/bin/rcs drill config/drills/gps/d01", How::kOptions,
     "minutes; drill_all_test.cpp"},
    {"build/release/bin/rcs drill my_drill.toml", How::kSlow, "a drive of 125 s"},
    {"build/release/bin/rcs why", How::kSlow, "a log of 125 s"},
    {"build/release/bin/rcs drive", How::kOptions, "minutes; drive_command_test.cpp"},
    {"build/release/bin/rcs faults --runs", How::kOptions, "hours; faults_command_test.cpp"},
    {"build/release/bin/rcs consistency -o", How::kOptions, "half an hour"},
    {"build/release/bin/rcs consistency --seeds 5", How::kOptions,
     "minutes; consistency_command_test.cpp"},
    {"build/release/bin/rcs outages my_run.log --config config/my_vehicle.toml --length",
     How::kSlow, "thirty drives"},
    {"build/release/bin/rcs outages my_run.log --config config/my_vehicle.toml --without",
     How::kSlow, "twenty drives"},
    {"build/release/bin/rcs outages my_run.log --config config/my_vehicle.toml --cut",
     How::kOptions, "a log of more than 257 s; outages_real_test.cpp"},
    {"cmake --install", How::kForeign, "changes the system; install_test.sh"},
    {"install -D", How::kForeign, "changes the system"},
    {"apt-get", How::kForeign, "changes the system"},
    {"systemctl", How::kForeign, "changes the system"},
    {"build/release/bin/rcs budget", How::kOptions, "five minutes; budget_command_test.cpp"},
    {"build/release/bin/dds_client", How::kForeign, "needs a gateway; live_pages_test.sh"},
    {"build/release/bin/ros2_bridge", How::kForeign, "needs a bus; ros2_bridge_live_test.cpp"},
    {"ros2", How::kForeign, "needs ROS 2"},
    {"$rcs import kitti", How::kSlowData, ""},
    {"$rcs replay config/kitti.toml", How::kSlowData, ""},
    {"$rcs eval result.log --truth poses.txt", How::kSlowData, ""},
    {"$rcs import comma2k19", How::kData, ""},
    {"$rcs replay config/comma2k19.toml", How::kData, ""},
    {"$rcs eval comma_result.log", How::kData, ""},
    {"$rcs import imu-gps test1", How::kData, ""},
    {"$rcs import imu-gps 2014", How::kData, ""},
    {"$rcs replay config/husky.toml", How::kData, ""},
}};

}  // namespace rcs::test
