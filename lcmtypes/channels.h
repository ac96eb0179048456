#pragma once
// Every channel of the system on one page: name, type, writer, rate.
// Names are [A-Z_]+ only, because LCM takes a channel for a regular expression; the prefix is the
// writer. A type that was released is never edited: add foo2_t.

namespace rcs::channel {

// clang-format off
// name                                                    type             writer      rate
inline constexpr char kLadarRanges[] = "LADAR_RANGES";     // ladar_ranges_t  driver/sim  16 x 10 Hz
inline constexpr char kLadarPoints[] = "LADAR_POINTS";     // ladar_points_t  driver/sim  48 x 10 Hz
inline constexpr char kIns[] = "INS";                      // ins_t           driver/sim  100-200 Hz
inline constexpr char kGpsFix[] = "GPS_FIX";               // gps_fix_t       driver/sim  1-10 Hz
inline constexpr char kOdometry[] = "ODOMETRY";            // odometry_t      driver/sim  10-50 Hz

inline constexpr char kSpRegistration[] = "SP_REGISTRATION";  // registration_t sp  1-2 per scan
inline constexpr char kSpPoints[] = "SP_POINTS";              // points_t       sp  1-4 per scan
inline constexpr char kSpEvent[] = "SP_EVENT";                // event_t        sp  on events
inline constexpr char kSpCycle[] = "SP_CYCLE";                // cycle_t        sp  per cycle, live
inline constexpr char kSpProcess[] = "SP_PROCESS";            // process_t       sp  1 Hz, live

inline constexpr char kWmNavState[] = "WM_NAV_STATE";      // nav_state_t     wm  50 Hz + per scan
inline constexpr char kWmInnovation[] = "WM_INNOVATION";   // innovation_t    wm  per measurement
inline constexpr char kWmIntegrity[] = "WM_INTEGRITY";     // integrity_t     wm  10 Hz
inline constexpr char kWmShadow[] = "WM_SHADOW";           // shadow_t        wm  3 x 2 Hz
inline constexpr char kWmMapPatch[] = "WM_MAP_PATCH";      // map_patch_t     wm  5 Hz
inline constexpr char kWmPathQuery[] = "WM_PATH_QUERY";        // path_query_t     operator  asked
inline constexpr char kWmPathSureness[] = "WM_PATH_SURENESS";  // path_sureness_t  wm  when asked
inline constexpr char kWmEvent[] = "WM_EVENT";             // event_t         wm  on events
inline constexpr char kWmCycle[] = "WM_CYCLE";             // cycle_t         wm  per cycle, live
inline constexpr char kWmProcess[] = "WM_PROCESS";         // process_t       wm  1 Hz, live

inline constexpr char kBgCommand[] = "BG_COMMAND";         // command_t       operator, gateway  1 Hz
inline constexpr char kBgStatus[] = "BG_STATUS";           // status_t        bg  10 Hz
inline constexpr char kBgPlan[] = "BG_PLAN";               // plan_t          bg  2-10 Hz
inline constexpr char kBgDrive[] = "BG_DRIVE";             // drive_t         bg  20 Hz
inline constexpr char kBgEvent[] = "BG_EVENT";             // event_t         bg  on events
inline constexpr char kBgCycle[] = "BG_CYCLE";             // cycle_t         bg  per cycle, live
inline constexpr char kBgProcess[] = "BG_PROCESS";         // process_t       bg  1 Hz, live

inline constexpr char kGatewayEvent[] = "GATEWAY_EVENT";   // event_t       gateway  on events
inline constexpr char kGatewayCycle[] = "GATEWAY_CYCLE";   // cycle_t       gateway  per cycle, live
inline constexpr char kGatewayProcess[] = "GATEWAY_PROCESS";  // process_t  gateway  1 Hz, live

inline constexpr char kUpEvent[] = "UP_EVENT";             // event_t         up  on events
inline constexpr char kUpProcess[] = "UP_PROCESS";         // process_t       up  1 Hz, live

inline constexpr char kSimTruth[] = "SIM_TRUTH";           // truth_t         sim  100 Hz
// clang-format on

}  // namespace rcs::channel
