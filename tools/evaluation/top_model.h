#pragma once
// State of `rcs top`: the newest status of every node, and a window of its cycles.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/publisher.h"
#include "tools/evaluation/received.h"

namespace rcs::evaluation {

/// Truncates a text and replaces control characters, which a terminal would execute, and non-ASCII
/// characters.
[[nodiscard]] std::string printable(std::string_view text);

/// A growing count, observed over a window of time.
class RateWindow {
 public:
  void add(Stamp arrival, std::int64_t counted);
  void forget_before(Stamp oldest);
  /// [1/s] over the window; nullopt with fewer than two observations.
  [[nodiscard]] std::optional<double> rate() const;

 private:
  struct Look {
    Stamp arrival;
    std::int64_t count;
  };
  std::deque<Look> looks_;
};

/// The values on the screen; ages and rates are relative to the time of the call.
struct TopView {
  struct Input {
    std::string channel;
    std::optional<double> rate_hz;
    std::optional<Duration> age;  ///< nullopt: nothing received yet
    std::int64_t dropped = 0;
    std::int64_t gaps = 0;
    std::int64_t malformed = 0;
    std::int64_t rejected = 0;  ///< of a second publisher of the channel
  };
  struct Node {
    std::string name;
    std::optional<Duration> received;  ///< since its last process_t; nullopt: none received
    bool alive = false;
    std::int64_t pid = 0;
    Publisher publisher;  ///< with pid: of the newest process_t of this name
    Duration up{};
    std::optional<double> cpu_percent;
    std::int64_t rss_kb = 0;
    std::int64_t heap_kb = 0;
    std::int8_t realtime_priority = 0;
    bool memory_locked = false;
    std::int64_t descriptors = 0;
    std::string note;
    std::optional<double> account_hz;  ///< units of work
    std::optional<Duration> used_p50;  ///< wall time, over the window
    std::optional<Duration> used_p99;
    std::optional<Duration> used_max;
    std::optional<Duration> budget;
    std::optional<Duration> min_slack;
    std::int64_t overruns = 0;
    std::int64_t missed = 0;
    std::int8_t degrade_level = 0;
    std::vector<Input> inputs;
  };
  /// A program that publishes <NAME>_PROCESS and is alive. Two of one name are two processes.
  struct Process {
    std::string node;
    std::int64_t pid = 0;
    Publisher publisher;
  };
  /// A publisher whose messages a node rejects (event publisher.rejected).
  struct Rejected {
    std::string channel;
    std::string by;  ///< node
    Publisher publisher;
    std::optional<Process> process;  ///< nullopt: it publishes no process_t
  };
  struct Nav {
    Duration received{};
    std::string mode;
    bool pose_valid = false;
    bool world_valid = false;
    double p_world_m[3] = {0.0, 0.0, 0.0};  ///< east, north, up
    double lat_deg = 0.0;                   ///< with lon_deg: of a valid world pose
    double lon_deg = 0.0;
    double heading_deg = 0.0;             ///< clockwise from north
    double sigma_m[3] = {0.0, 0.0, 0.0};  ///< of the world pose, along vehicle x, y, z
    double sigma_yaw_rad = 0.0;
    double speed_mps = 0.0;
    double distance_since_gps_m = 0.0;
    std::int64_t world_resets = 0;
    int map_epoch = 0;
    struct Age {
      std::string source;
      std::optional<Duration> age;  ///< since the last accepted; nullopt: never
    };
    std::vector<Age> ages;
  };
  struct Integrity {
    Duration received{};
    bool bounded = false;  ///< the protection levels are finite
    double protection_horizontal_m = 0.0;
    double protection_vertical_m = 0.0;
    double limit_horizontal_m = 0.0;
    double limit_vertical_m = 0.0;
    int alerts = 0;  ///< integrity_t::ALERT_*
    std::string ins;
    std::string gps;
    std::string ladar;
  };
  struct Fix {
    Duration received{};
    std::string type;
    int satellites = 0;
  };
  struct Status {
    Duration received{};
    std::string status;
    std::string state;
    std::string reason;
    std::int64_t echo_serial = 0;
    std::string issuer;
    std::string emergency_stop;  ///< "none", "LATCHED", ...
  };
  /// The last choice of the mission.
  struct Routes {
    Duration received{};
    std::size_t candidates = 0;
    double alert_limit_m = 0.0;
    struct Chosen {
      double length_m = 0.0;
      double time_s = 0.0;
      double level_max_m = 0.0;  ///< if GPS fails at its start; infinite: not predicted
    };
    std::optional<Chosen> chosen;
  };
  struct Event {
    Duration age{};
    std::optional<Duration> of_run;  ///< since the start of the first node that is alive
    std::string node;
    int severity = 0;
    std::string code;
    std::string text;
    std::int64_t repeated = 0;
  };
  std::vector<Node> nodes;         ///< by name
  std::vector<Process> processes;  ///< by name and publisher
  std::vector<Rejected> rejected;  ///< within the last TopModel::kRejectedFor
  std::int64_t now_utime = 0;      ///< wall clock; 0: unknown
  std::optional<Nav> nav;
  std::optional<Integrity> integrity;
  std::optional<Fix> fix;
  std::optional<Status> status;   ///< of bg
  std::optional<Status> mission;  ///< of the mission
  std::optional<Routes> routes;
  std::vector<Event> events;                      ///< newest first
  std::map<std::string, std::int64_t> malformed;  ///< messages by channel, as subscribed
};

/// Messages are not assumed valid: texts are cut and sanitized, the numbers of nodes, processes,
/// inputs and events are bounded.
class TopModel {
 public:
  static constexpr Duration kWindow = std::chrono::seconds(5);
  static constexpr Duration kSilent = std::chrono::seconds(3);
  static constexpr std::size_t kMaxNodes = 16;
  static constexpr std::size_t kMaxInputs = 16;
  static constexpr std::size_t kMaxEvents = 50;
  static constexpr std::size_t kMaxProcesses = 32;
  static constexpr std::size_t kMaxRejected = 16;
  /// The event is published every 5 s while the messages are received.
  static constexpr Duration kRejectedFor = std::chrono::seconds(15);

  void on_process(const process_t& m, Stamp arrival);
  void on_cycle(const cycle_t& m, Stamp arrival);
  void on_event(const event_t& m, Stamp arrival);
  void on_nav(const nav_state_t& m, Stamp arrival);
  void on_integrity(const integrity_t& m, Stamp arrival);
  void on_fix(const gps_fix_t& m, Stamp arrival);
  void on_status(const status_t& m, Stamp arrival);
  void on_mission(const status_t& m, Stamp arrival);
  void on_routes(const routes_t& m, Stamp arrival);
  /// @param channel  as subscribed
  void on_malformed(std::string_view channel) { ++malformed_[std::string(channel)]; }

  /// @param now_utime  wall clock at `now`; 0: unknown
  [[nodiscard]] TopView view(Stamp now, std::int64_t now_utime = 0);

 private:
  struct Work {
    Stamp arrival;
    Duration used{};
    Duration slack{};
  };
  struct InputState {
    RateWindow received;
    Stamp last;  // of a message, from the age reported by the node
    bool any = false;
    TopView::Input metrics;
  };
  struct NodeState {
    TopView::Node metrics;
    std::optional<Stamp> process_arrival;
    Stamp start;
    RateWindow cpu_us;
    RateWindow accounts;
    std::int64_t account_count = 0;
    std::deque<Work> work;
    std::map<std::string, InputState> inputs;
  };
  NodeState* node(std::string_view name);
  void note_process(const process_t& m, Stamp arrival);
  void note_rejection(const event_t& m, Stamp arrival);
  void view_processes(Stamp now, TopView* view) const;
  void view_work(NodeState* n) const;

  struct KnownProcess {
    TopView::Process process;
    Stamp arrival;
  };
  struct KnownRejection {
    TopView::Rejected rejected;
    Stamp arrival;
  };

  std::map<std::string, NodeState> nodes_;
  std::vector<KnownProcess> processes_;
  std::vector<KnownRejection> rejections_;
  std::deque<Received<event_t>> events_;  // newest first
  std::optional<Received<nav_state_t>> nav_;
  std::optional<Received<integrity_t>> integrity_;
  std::optional<Received<gps_fix_t>> fix_;
  std::optional<Received<status_t>> status_;
  std::optional<Received<status_t>> mission_;
  std::optional<Received<routes_t>> routes_;
  std::map<std::string, std::int64_t> malformed_;
};

}  // namespace rcs::evaluation
