#pragma once
// A simulated vehicle as its processes on this network namespace's bus: `rcs up` with sp, wm, bg
// and gateway, the simulator, and `rcs go` as the operator, who sends the vehicle around the course
// repeatedly.

#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/base/linear.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/rcs/vehicle/child_process.h"

namespace rcs::live_faults {

/// The nodes that `rcs up` starts here.
inline const std::vector<std::string> kNodes = {"sp", "wm", "bg", "gateway"};

/// A closed course in the world of config/sim/drive.toml; the start is its last waypoint.
[[nodiscard]] const std::vector<Vec2>& course_world();
inline constexpr double kRadius_m = 3.0;      ///< a waypoint is reached within
inline constexpr double kMaxSpeed_mps = 6.0;  ///< that the operator allows

class VehicleRun {
 public:
  /// @param vehicle_toml  more of the vehicle's configuration
  /// @param sim_arguments  more of the simulator's command line
  explicit VehicleRun(const std::string& vehicle_toml,
                      const std::vector<std::string>& sim_arguments = {});
  VehicleRun(const VehicleRun&) = delete;
  VehicleRun& operator=(const VehicleRun&) = delete;
  ~VehicleRun();

  /// The reason why it cannot run; empty: it can.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] Bus* bus() { return bus_.get(); }
  [[nodiscard]] Stamp now() const { return timeline_->now(); }

  /// Delivers messages and supervises the processes.
  /// @param enough  evaluated after every message; empty: until the time is over
  /// @return false: the time was over before `enough` returned true, or there is trouble()
  bool run_until(Stamp until, const std::function<bool()>& enough);

  /// The newest pid that a node has published; 0: none was received.
  [[nodiscard]] int pid_of(const std::string& node) const;
  [[nodiscard]] Stamp received_first(const std::string& node) const;
  void send_signal(const std::string& node, int signal) const;
  /// To the simulator, which is the vehicle's sensors; its end is no trouble() from now on.
  void send_signal_to_sim(int signal);
  void send_signal_to_up(int signal);
  /// Kills `rcs up`, and with it all nodes, and starts it again.
  void restart_up();
  /// Runs one of our programs while the vehicle continues.
  /// @return its exit status; -1: it did not end in time, or there is trouble()
  int run_program(const std::string& program, const std::vector<std::string>& arguments,
                  Duration most);

  /// Records all channels from now on into the folder of keep_files(), at most 4 GB.
  void record();
  /// An off-board DDS program that receives from the vehicle; it is restarted when it has exited.
  void keep_client();
  /// The environment of DDS programs on this computer.
  static void use_loopback();
  void kill_client();
  [[nodiscard]] int clients_started() const { return clients_; }

  /// The operator's next command contains the waypoints from this one on.
  void set_next_waypoint(std::size_t next) { next_waypoint_ = next; }
  [[nodiscard]] int courses() const { return courses_; }
  /// Reasons for which the operator ended without arriving.
  [[nodiscard]] const std::vector<std::string>& gave_up() const { return gave_up_; }
  /// Keeps the output of the processes in the returned folder.
  const std::filesystem::path& keep_files();
  /// Ends all processes. @return the simulator's summary of the drive
  std::string end();

 private:
  struct Running {
    std::string name;
    cli::ChildProcess process;
    std::ofstream log;
    std::string last_line;
  };
  struct Life {
    int pid = 0;
    Stamp first;
  };

  std::string write_files(const std::string& vehicle_toml);
  [[nodiscard]] std::unique_ptr<Running> start(const std::string& name, const std::string& program,
                                               const std::vector<std::string>& arguments);
  void start_up();
  void look_after();
  void look_after_operator();
  void look_after_client();
  /// @return its exit status, if it has ended
  std::optional<cli::Exit> read(Running* running);

  std::filesystem::path folder_;
  bool keep_files_ = false;
  std::string trouble_;
  StopSignals stop_;
  std::unique_ptr<LcmBus> bus_;
  std::unique_ptr<LiveTimeline> timeline_;
  std::deque<Tap<process_t>> processes_;
  std::map<std::string, Life> lives_;
  std::unique_ptr<Running> up_, sim_, operator_, client_, program_, recorder_;
  Stamp next_look_ = Stamp::min();
  Stamp next_ask_ = Stamp::min();
  bool sim_may_end_ = false;
  std::size_t next_waypoint_ = 0;
  int courses_ = 0;
  std::vector<std::string> gave_up_;
  bool with_client_ = false;
  int clients_ = 0;
};

}  // namespace rcs::live_faults
