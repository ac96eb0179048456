// The exit status of every command: docs/user/getting_started.md, rcs/base/exit_status.h.

#include <gmock/gmock.h>

#include "rcs/base/exit_status.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

struct Row {
  int status;
  const char* arguments;  ///< $S: folder of the sources, $F: of the inputs, $N: a new folder
};

/// Inputs made once: drive.log (12 s, with map/), run.log (its replay), two clouds, configurations.
class ExitStatus : public RcsCommand {
 protected:
  static void SetUpTestSuite() {
    inputs_ = (std::filesystem::temp_directory_path() / "rcs_exit_status_XXXXXX").string();
    RCS_CHECK(mkdtemp(inputs_.data()) != nullptr);
    std::ofstream(inputs_ + "/garbage") << "neither a log nor a map, a cloud or a table = [\n";
    std::ofstream(inputs_ + "/invalid.toml") << "[sp.icp]\ngate_m = -1\n";
    std::ofstream(inputs_ + "/far.toml")
        << text_of(variable("RCS_SOURCE_DIR") + "/config/demo3.toml")
        << "\n[world]\ndatum_lat_deg = 1.0\n"
           "datum_lon_deg = 8.4\ndatum_height_m = 110.0\n";
    std::ofstream(inputs_ + "/empty.csv") << "x_m,y_m\n";
    std::ofstream(inputs_ + "/nothing.toml") << "";
    for (const char* name : {"passes", "fails"}) {
      std::ofstream(inputs_ + "/" + name + ".toml")
          << "name = \"GPS lost\"\n[run]\nlength_s = 12\n[[stimulus]]\nkind = \"dropout\"\nsource "
             "= \"gps\"\n"
             "begin_s = 9\nlength_s = 2\n[limits]\nhorizontal_m = "
          << (name[0] == 'p' ? "50\n" : "0\n");
    }
    std::ofstream(inputs_ + "/no_scenario.toml")
        << "[run]\nlength_s = 12\nscenario = \"absent.toml\"\n[[stimulus]]\nkind = "
           "\"dropout\"\nsource = \"gps\"\n"
           "begin_s = 9\nlength_s = 2\n[limits]\nhorizontal_m = 50\n";
    std::ofstream truth(inputs_ + "/kitti.txt");
    for (int row = 0; row < 200; ++row) truth << "1 0 0 0 0 1 0 0 0 0 1 0\n";
    std::ofstream plane(inputs_ + "/plane.xyz");
    for (int i = 0; i < 50; ++i) {
      for (int j = 0; j < 50; ++j) plane << 0.4 * j << ' ' << 0.4 * i << " 0\n";
    }
    const std::string rcs = variable("RCS_BIN_DIR") + "/rcs ";
    const std::string source = variable("RCS_SOURCE_DIR");
    const std::string commands =
        rcs + "sim " + source + "/config/sim/drill.toml --duration 12 -o " + inputs_ +
        "/drive.log --prior-map " + inputs_ + "/map >/dev/null 2>&1 && " + rcs + "replay " +
        source + "/config/demo3.toml " + inputs_ + "/drive.log -o " + inputs_ +
        "/run.log >/dev/null 2>&1 && cp -r " + inputs_ + "/map " + inputs_ +
        "/broken && for f in " + inputs_ + "/broken/*/*.tile; do echo x >>$f; done";
    RCS_CHECK(std::system(commands.c_str()) == 0);  // NOLINT(cert-env33-c)
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(inputs_); }

  [[nodiscard]] std::string filled(std::string text) const {
    const std::pair<const char*, std::string> names[] = {
        {"$S", variable("RCS_SOURCE_DIR")}, {"$F", inputs_}, {"$N", folder_}};
    for (const auto& [name, value] : names) {
      for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name)) {
        text.replace(at, 2, value);
      }
    }
    return text;
  }
  template <std::size_t N>
  void expect(const Row (&rows)[N]) {
    for (const Row& row : rows) {
      EXPECT_EQ(rcs(filled(row.arguments)), row.status) << row.arguments << "\n" << messages();
      EXPECT_EQ(messages().empty() && row.status > kExitUsage, false) << row.arguments;
    }
  }
  /// Of any program; its output is not kept.
  [[nodiscard]] int shell(const std::string& command) const {
    const std::string line = filled(command) + " >/dev/null 2>&1";
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  static inline std::string inputs_;
};

TEST_F(ExitStatus, IsZeroWhenTheWorkIsDone) {
  constexpr Row kRows[] = {
      {0, "--help"},
      {0, "log info --help"},
      {0, "help"},
      {0, "help log info"},
      {0, "log info $F/drive.log"},
      {0, "log list $F/drive.log"},
      {0, "log cut $F/drive.log --to 2 -o $N/cut.log"},
      {0, "log cut $F/run.log --around mode -o $N/mode.log"},
      {0, "log csv $F/drive.log --channel GPS_FIX"},
      {0, "eval $F/run.log"},
      {0, "eval $F/run.log --truth $F/kitti.txt --format kitti --first 3"},
      {0, "report $F/run.log -o $N/report.html"},
      {0, "replay $S/config/demo3.toml $F/drive.log --to 8 -o $N/run.log"},
      {0, "sim $S/config/sim/drill.toml --duration 2 -o $N/sim.log"},
      {0, "why $F/run.log 10"},
      {0, "map info $F/map --check"},
      {0, "map export $F/map --hillshade $N/map.png"},
      {0, "map diff $F/map $F/map"},
      {0, "map localizability $F/map --step 20"},
      {0, "drill --list --folder $S/config/drills"},
      {0, "drill $F/passes.toml --scenario $S/config/sim/drill.toml --config $S/config/demo3.toml"},
      {0, "config list sp.icp"},
      {0, "config explain gate_m"},
      {0, "config check $S/config/demo3.toml"},
      {0, "config show $S/config/demo3.toml --changed"},
      {0, "keys $N/keys --vehicle a"},
      {0, "up --check $S/config/demo3.toml"},
  };
  expect(kRows);
}

TEST_F(ExitStatus, IsOneWhenTheWorkIsDoneAndTheResultIsNegative) {
  constexpr Row kRows[] = {
      {1, "log info $F/garbage"},
      {1, "log info $F/garbage --json"},
      {1, "log list $F/garbage"},
      {1, "log list $F/garbage --json"},
      {1, "log cut $F/run.log --around solution.lost -o $N/lost.log"},
      {1, "replay $F/far.toml $F/drive.log -o $N/run.log"},
      {1, "register $F/plane.xyz $F/plane.xyz"},
      {1, "map info $F/broken --check"},
      {1, "drill $F/fails.toml --scenario $S/config/sim/drill.toml --config $S/config/demo3.toml"},
      {1, "map locate $F/map $F/run.log --near 0,0 --heading 0 --within 20 --for 2"},
      {1, "config check $F/invalid.toml"},
      {1, "config check $F/garbage"},
      {1, "up --check $F/invalid.toml"},
      {1, "up --check $F/garbage"},
  };
  expect(kRows);
}

TEST_F(ExitStatus, IsTwoForAnInvalidCommandLine) {
  constexpr Row kRows[] = {
      {2, ""},
      {2, "nonsense"},
      {2, "log"},
      {2, "view $F/run.log --shot noon -o $N/x.png"},
      {2, "log info"},
      {2, "log cut $F/drive.log"},
      {2, "log cut $F/drive.log --around no.such_event -o $N/x.log"},
      {2, "record"},
      {2, "record $N/x --size-mb 0"},
      {2, "log csv $F/drive.log --channel NO_SUCH_CHANNEL"},
      {2, "eval $F/run.log --truth $F/empty.csv"},
      {2, "eval $F/run.log --export $N/x.csv"},
      {2, "report $F/run.log -o $N/x.html --gps-cut 5"},
      {2, "replay $S/config/demo3.toml"},
      {2, "sim"},
      {2, "play $F/drive.log --speed 0"},
      {2, "import kitti --scans $F"},
      {2, "import imu-gps $F/empty.csv"},
      {2, "import comma2k19 $F"},
      {2, "why $F/run.log"},
      {2, "smooth $F/drive.log -o $N/x --rounds 0 --config $S/config/demo3.toml"},
      {2, "register $F/plane.xyz"},
      {2, "eval $F/run.log --truth $F/kitti.txt --format kitti --first -5"},
      {2, "sim $S/config/sim/drill.toml --gps-lost-after '' -o $N/x"},
      {2, "sim $S/config/sim/drill.toml --seed 99999999999999999999 -o $N/x"},
      {2, "view $F/run.log --host ''"},
      {2, "eval $F/run.log --svg --json"},
      {2, "register $F/plane.xyz $F/plane.xyz --guess 1"},
      {2, "table1 --seeds 17"},
      {2, "map"},
      {2, "map info"},
      {2, "map export $F/map"},
      {2, "map merge $F/map -o $N/x"},
      {2, "map diff $F/map"},
      {2, "map build $F/run.log --date tomorrow -o $N/x"},
      {2, "map import raster $F/garbage --sigma 1 --date tomorrow -o $N/x"},
      {2, "map build $F/run.log --date 2020-02-30 -o $N/x"},
      {2, "map build $F/run.log --date 2023-02-29 -o $N/x"},
      {2, "map import cloud $F/plane.xyz -o $N/x"},
      {2, "map import av2 $F -o $N/x"},
      {2, "map locate $F/map $F/run.log"},
      {2, "map match $F/map $F/plane.xyz --pose 1"},
      {2, "map localizability $F/map --drift 0.1"},
      {2, "map study"},
      {2, "drill"},
      {2, "consistency --seeds 0"},
      {2, "faults --runs 0"},
      {2, "faults --only no_such_class"},
      {2, "faults --faults 2 --only ins"},
      {2, "outages $F/drive.log --config $S/config/demo3.toml --cut 20,10"},
      {2, "budget $S/config/demo3.toml"},
      {2, "config list no.such.table"},
      {2, "config explain no_such_key"},
      {2, "config check"},
      {2, "keys"},
      {2, "load"},
      {2, "predict"},
      {2, "go"},
      {2, "go --halt --release"},
      {2, "top --listen 0"},
      {2, "up"},
  };
  expect(kRows);
}

TEST_F(ExitStatus, IsThreeWhenAFileOrTheNetworkPreventsTheWork) {
  constexpr Row kRows[] = {
      // A missing file.
      {3, "view $F/none.log"},
      {3, "log info $F/none.log"},
      {3, "log info $F/map"},
      {3, "record /proc/nowhere"},
      {3, "log list $F/none.log"},
      {3, "log cut $F/none.log -o $N/x"},
      {3, "log csv $F/none.log --channel GPS_FIX"},
      {3, "eval $F/none.log"},
      {3, "report $F/none.log -o $N/x.html"},
      {3, "replay $F/none.toml $F/drive.log -o $N/x"},
      {3, "sim $F/none.toml -o $N/x"},
      {3, "play $F/none.log"},
      {3, "import kitti --scans $F/none --poses $F/garbage --calib $F -o $N/x"},
      {3, "import imu-gps $F/none.csv --columns $F/garbage -o $N/x"},
      {3, "import comma2k19 $F/none -o $N/x"},
      {3, "why $F/none.log 1"},
      {3, "smooth $F/none.log --config $S/config/demo3.toml -o $N/x"},
      {3, "register $F/none.xyz $F/plane.xyz"},
      {3, "table1 --data $F/none"},
      {3, "map info $F/none"},
      {3, "map export $F/none --hillshade $N/x.png"},
      {3, "map merge $F/none $F/map -o $N/x"},
      {3, "map diff $F/map $F/none"},
      {3, "map build $F/none.log -o $N/x"},
      {3, "map import raster $F/none.tif --sigma 1 -o $N/x"},
      {3, "map import cloud $F/none.xyz --sigma 1 -o $N/x"},
      {3, "map import av2 $F/none --sigma 1 -o $N/x"},
      {3, "map locate $F/none $F/run.log --near 0,0 --heading 0"},
      {3, "map match $F/none $F/plane.xyz --pose '0 0 0 0 0 0 1'"},
      {3, "map localizability $F/none"},
      {3, "map study $F/none.toml"},
      {3, "drill $F/none.toml"},
      {3, "consistency --config $F/none.toml"},
      {3, "faults --config $F/none.toml"},
      {3, "faults --runs 1 --scenario $F/garbage"},
      {3, "drill $F/nothing.toml"},
      {3, "outages $F/none.log --config $S/config/demo3.toml"},
      {3, "budget $F/none.toml $F/drive.log"},
      {3, "config check $F/none.toml"},
      {3, "config show $F/none.toml"},
      {3, "predict --path $F/none.csv"},
      {3, "go --scenario $F/none.toml"},
      {3, "up $F/none.toml"},
      {3, "up --check $F/none.toml"},
      // A file that is not what the command reads, or has not what it needs.
      {3, "log list $F"},
      {3, "log cut $F/drive.log --from 100 -o $N/x"},
      {3, "log csv $F/drive.log --channel BG_DRIVE"},
      {3, "eval $F/garbage"},
      {3, "eval $F/run.log --truth $F/kitti.txt --format kitti --first 18446744073709551610"},
      {3, "report $F/drive.log -o $N/x.html"},
      {3, "replay $F/garbage $F/drive.log -o $N/x"},
      {3, "replay $F/invalid.toml $F/drive.log -o $N/x"},
      {3, "replay $S/config/demo3.toml $F/drive.log --from 100 -o $N/x"},
      {3, "sim $F/garbage -o $N/x"},
      {3, "import imu-gps $F/empty.csv --columns $F/garbage -o $N/x"},
      {3, "import comma2k19 $F -o $N/x"},
      {3, "why $F/run.log 1000"},
      {3, "smooth $F/garbage --config $S/config/demo3.toml -o $N/x"},
      {3, "register $F/garbage $F/plane.xyz"},
      {3, "table1 --data $F"},
      {3, "map info $F"},
      {3, "map export $F/map --level 99 --hillshade $N/x.png"},
      {3, "map build $F/drive.log -o $N/x"},
      {3, "map import raster $F/garbage --sigma 1 -o $N/x"},
      {3, "map import cloud $F/plane.xyz --sigma 1 -o $N/x"},
      {3, "map import av2 $F --sigma 1 -o $N/x"},
      {3, "map localizability $F/map --path $F/empty.csv"},
      {3, "map study $F/garbage --config $S/config/demo3.toml"},
      {3, "drill $F/garbage"},
      {3, "drill --all --folder $F/map"},
      {3, "drill $F/no_scenario.toml --config $S/config/demo3.toml"},
      {3, "consistency --config $F/invalid.toml"},
      {3, "faults --config $F/invalid.toml"},
      {3, "outages $F/garbage --config $S/config/demo3.toml"},
      {3, "budget $F/garbage $F/drive.log"},
      {3, "config show $F/invalid.toml"},
      {3, "predict --path $F/empty.csv"},
      {3, "up $F/invalid.toml"},
      // An output that cannot be written.
      {3, "log cut $F/drive.log -o $F/garbage/x"},
      {3, "eval $F/run.log --svg $F/garbage/x.svg"},
      {3, "report $F/run.log -o $F/garbage/x.html"},
      {3, "sim $S/config/sim/drill.toml --duration 1 -o $F/garbage/x"},
      {3, "map export $F/map --geotiff $F/garbage/x.tif"},
      {3, "keys $F/garbage --vehicle a"},
      {3, "keys $N/no_keys"},
      // The network.
      {3, "play $F/drive.log --lcm-url nonsense"},
      {3, "sim $S/config/sim/drill.toml --lcm-url nonsense"},
      {3, "go --halt --lcm-url nonsense"},
      {3, "top --once --lcm-url nonsense"},
      {3, "predict --to 1,1 --lcm-url nonsense"},
  };
  expect(kRows);
}

TEST_F(ExitStatus, IsThirtyAndAHundredAfterCtrlC) {
  const std::string interrupted =
      "cd $S && timeout --preserve-status -s INT 0.7 " + variable("RCS_BIN_DIR") + "/rcs ";
  for (const char* arguments : {
           "sim config/sim/drill.toml --duration 3600 -o $N/x",
           "drill --all --jobs 1",
           "consistency --jobs 1",
           "faults --jobs 1",
           "map study config/sim/drill_long.toml --jobs 1",
           "map localizability $F/map --step 0.5",
       }) {
    EXPECT_EQ(shell(interrupted + arguments), 130) << arguments;
  }
  EXPECT_EQ(
      shell(interrupted + "top --once --listen 60 --lcm-url 'udpm://239.255.76.99:9999?ttl=0'"),
      130);
  // A command that does not catch the signal itself, while it waits for the reader of its output.
  EXPECT_EQ(shell("{ timeout --preserve-status -s TERM 2 " + variable("RCS_BIN_DIR") +
                  "/rcs config list --json 2>$N/why; echo $? >$N/status; } | sleep 4"),
            0);
  EXPECT_EQ(text_of(folder_ + "/status"), "130\n");
  EXPECT_EQ(text_of(folder_ + "/why"), "rcs: interrupted\n");
  EXPECT_EQ(shell(interrupted + "load cpu"), 0) << "which runs until Ctrl-C";
}

TEST_F(ExitStatus, IsTheSameForTheOtherPrograms) {
  const std::string bin = variable("RCS_BIN_DIR") + "/";
  for (const char* node : {"sp", "wm"}) {
    const std::string program = bin + node;
    EXPECT_EQ(shell(program + " --help"), 0) << node;
    EXPECT_EQ(shell(program), 2) << node;
    EXPECT_EQ(shell(program + " $F/none.toml"), 3) << node;
    EXPECT_EQ(shell(program + " $F/garbage"), 3) << node;
    EXPECT_EQ(shell(program + " --check $F/none.toml"), 3) << node;
    EXPECT_EQ(shell(program + " --check $F"), 3) << node;
    EXPECT_EQ(shell(program + " --check $F/garbage"), 1) << node;
    EXPECT_EQ(shell(program + " --check $S/config/demo3.toml"), 0) << node;
  }
  EXPECT_EQ(shell(bin + "sp $F/invalid.toml"), 3);
  EXPECT_EQ(shell(bin + "sp --check $F/invalid.toml"), 1);
  EXPECT_EQ(shell(bin + "sim"), 2);
  EXPECT_EQ(shell(bin + "sim $F/none.toml"), 3);
  EXPECT_EQ(shell(bin + "sim $S/config/sim/drill.toml --lcm-url nonsense"), 3);
  for (const char* script : {"build --nonsense", "setup --nonsense", "bare_machine --nonsense",
                             "demo x", "bench x", "fuzz x", "results no_such_group"}) {
    EXPECT_EQ(shell(std::string("$S/tools/") + script), 2) << script;
  }
  for (const char* script :
       {"build", "setup", "bare_machine", "demo", "bench", "fuzz", "results", "test"}) {
    EXPECT_EQ(shell(std::string("$S/tools/") + script + " --help | grep -q 'Exit status: 0'"), 0)
        << script;
  }
}

}  // namespace
}  // namespace rcs::test
