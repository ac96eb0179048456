#pragma once
// The list of all channels of the system. Names are [A-Z0-9_]+ only, because LCM interprets a
// channel name as a regular expression; the prefix is the writer. The constants, the table and the
// dispatch by type (channel_types.h) derive from this list.

#include <array>
#include <cstddef>
#include <string_view>

// clang-format off
// constant, name, kind, type, writer, rate
#define RCS_CHANNELS(X)                                                                         \
  X(kLadarRanges, "LADAR_RANGES", kSensor, ladar_ranges_t, "driver, sim", "16 x 10 Hz")         \
  X(kLadarPoints, "LADAR_POINTS", kSensor, ladar_points_t, "driver, sim", "48 x 10 Hz")         \
  X(kIns, "INS", kSensor, ins_t, "driver, sim", "100-200 Hz")                                   \
  X(kGpsFix, "GPS_FIX", kSensor, gps_fix_t, "driver, sim", "1-10 Hz")                           \
  X(kOdometry, "ODOMETRY", kSensor, odometry_t, "driver, sim", "10-50 Hz")                      \
  X(kSpRegistration, "SP_REGISTRATION", kOutput, registration_t, "sp", "1-2 per scan")          \
  X(kSpPoints, "SP_POINTS", kOutput, points_t, "sp", "1-4 per scan")                            \
  X(kSpEvent, "SP_EVENT", kOutput, event_t, "sp", "on events")                                  \
  X(kSpCycle, "SP_CYCLE", kAccount, cycle_t, "sp", "per cycle, live")                           \
  X(kSpProcess, "SP_PROCESS", kAccount, process_t, "sp", "1 Hz, live")                          \
  X(kWmNavState, "WM_NAV_STATE", kOutput, nav_state_t, "wm", "50 Hz + per scan")                \
  X(kWmInnovation, "WM_INNOVATION", kOutput, innovation_t, "wm", "per measurement")             \
  X(kWmIntegrity, "WM_INTEGRITY", kOutput, integrity_t, "wm", "10 Hz")                          \
  X(kWmSubfilter, "WM_SUBFILTER", kOutput, subfilter_t, "wm", "3 x 2 Hz")                       \
  X(kWmMapPatch, "WM_MAP_PATCH", kOutput, map_patch_t, "wm", "5 Hz")                            \
  X(kWmPathQuery, "WM_PATH_QUERY", kCommand, path_query_t, "operator, mission", "on request")   \
  X(kWmPathUncertainty, "WM_PATH_UNCERTAINTY", kOutput, path_uncertainty_t, "wm", "on request") \
  X(kWmEvent, "WM_EVENT", kOutput, event_t, "wm", "on events")                                  \
  X(kWmCycle, "WM_CYCLE", kAccount, cycle_t, "wm", "per cycle, live")                           \
  X(kWmProcess, "WM_PROCESS", kAccount, process_t, "wm", "1 Hz, live")                          \
  X(kBgCommand, "BG_COMMAND", kCommand, command_t, "operator, gateway, mission", "1 Hz")        \
  X(kBgStop, "BG_STOP", kCommand, command_t, "operator, gateway", "on a stop, a release")       \
  X(kBgStatus, "BG_STATUS", kOutput, status_t, "bg", "20 Hz")                                   \
  X(kBgPlan, "BG_PLAN", kOutput, plan_t, "bg", "up to 4 Hz")                                   \
  X(kBgDrive, "BG_DRIVE", kOutput, drive_t, "bg", "20 Hz")                                      \
  X(kBgEvent, "BG_EVENT", kOutput, event_t, "bg", "on events")                                  \
  X(kBgCycle, "BG_CYCLE", kAccount, cycle_t, "bg", "per cycle, live")                           \
  X(kBgProcess, "BG_PROCESS", kAccount, process_t, "bg", "1 Hz, live")                          \
  X(kMissionCommand, "MISSION_COMMAND", kCommand, command_t, "operator, gateway", "1 Hz")       \
  X(kMissionStatus, "MISSION_STATUS", kOutput, status_t, "mission", "1 Hz")                     \
  X(kMissionRoutes, "MISSION_ROUTES", kOutput, routes_t, "mission", "on a choice")              \
  X(kMissionEvent, "MISSION_EVENT", kOutput, event_t, "mission", "on events")                   \
  X(kMissionCycle, "MISSION_CYCLE", kAccount, cycle_t, "mission", "per cycle, live")            \
  X(kMissionProcess, "MISSION_PROCESS", kAccount, process_t, "mission", "1 Hz, live")           \
  X(kGatewayEvent, "GATEWAY_EVENT", kOutput, event_t, "gateway", "on events")                   \
  X(kGatewayCycle, "GATEWAY_CYCLE", kAccount, cycle_t, "gateway", "per cycle, live")            \
  X(kGatewayProcess, "GATEWAY_PROCESS", kAccount, process_t, "gateway", "1 Hz, live")           \
  X(kRos2BridgeEvent, "ROS2_BRIDGE_EVENT", kOutput, event_t, "ros2_bridge", "on events")        \
  X(kRos2BridgeCycle, "ROS2_BRIDGE_CYCLE", kAccount, cycle_t, "ros2_bridge", "per cycle, live") \
  X(kRos2BridgeProcess, "ROS2_BRIDGE_PROCESS", kAccount, process_t, "ros2_bridge", "1 Hz, live")\
  X(kUpEvent, "UP_EVENT", kOutput, event_t, "up", "on events")                                  \
  X(kUpProcess, "UP_PROCESS", kAccount, process_t, "up", "1 Hz, live")                          \
  X(kRecordEvent, "RECORD_EVENT", kOutput, event_t, "record", "on events")                      \
  X(kRecordProcess, "RECORD_PROCESS", kAccount, process_t, "record", "1 Hz, live")              \
  X(kSimTruth, "SIM_TRUTH", kTruth, truth_t, "sim", "100 Hz")
// clang-format on

namespace rcs::channel {

enum class Kind {
  kSensor,   ///< published by a driver; the only kind that a replay publishes again
  kCommand,  ///< from a superior or an operator
  kOutput,   ///< result of a node
  kAccount,  ///< timing and process statistics of a node: live only
  kTruth     ///< ground truth of the simulator, for evaluation only
};

struct Info {
  const char* name;
  Kind kind;
  const char* type;
  const char* writer;
  const char* rate;
};

#define RCS_CHANNEL_CONSTANT(constant, name, kind, type, writer, rate) \
  inline constexpr char constant[] = name;
RCS_CHANNELS(RCS_CHANNEL_CONSTANT)
#undef RCS_CHANNEL_CONSTANT

inline constexpr Info kAll[] = {
#define RCS_CHANNEL_ROW(constant, name, kind, type, writer, rate) \
  {constant, Kind::kind, #type, writer, rate},
    RCS_CHANNELS(RCS_CHANNEL_ROW)
#undef RCS_CHANNEL_ROW
};

constexpr std::size_t count_of(Kind kind) {
  std::size_t n = 0;
  for (const Info& c : kAll) n += c.kind == kind ? 1 : 0;
  return n;
}

template <Kind kKind>
constexpr std::array<const char*, count_of(kKind)> names_of() {
  std::array<const char*, count_of(kKind)> names{};
  std::size_t n = 0;
  for (const Info& c : kAll) {
    if (c.kind == kKind) names[n++] = c.name;
  }
  return names;
}

inline constexpr auto kSensors = names_of<Kind::kSensor>();

constexpr bool is_command(std::string_view channel) {
  for (const char* command : names_of<Kind::kCommand>()) {
    if (channel == command) return true;
  }
  return false;
}

constexpr bool is_sensor(std::string_view channel) {
  for (const char* sensor : kSensors) {
    if (channel == sensor) return true;
  }
  return false;
}

}  // namespace rcs::channel
