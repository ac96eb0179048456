#pragma once
// The list of all events that nodes publish on <NAME>_EVENT. rcs/node/report.h publishes only
// entries of this list; docs/reference/events.md is generated from it.

namespace rcs::event {

enum class Severity { kInfo, kWarning, kError };

/// How many messages of one code are published within the report interval of the node. The
/// following message has the number of those that were not published.
enum class Limit {
  kOne,
  kTen  ///< of changes of state: subscribers need the end as well as the beginning
};

struct Info {
  const char* publisher;  ///< node, or several: "sp, wm"
  const char* code;       ///< event_t::code, for programs
  Severity severity;      ///< of the beginning, if the event also reports an end
  Limit limit;
  const char* meaning;
  const char* cause;
  const char* remedy;  ///< what the operator does
};

// clang-format off
// constant, publisher, code, severity, limit, meaning, cause, remedy
#define RCS_EVENTS(X)                                                                              \
  X(kSpInputRejected, "sp", "input.rejected", kWarning, kOne,                                      \
    "A message on WM_NAV_STATE was rejected. SP predicts the motion from the INS alone until the " \
    "next valid message.",                                                                         \
    "A pose, velocity or covariance is not finite, is implausible, or is not positive definite.",  \
    "Check WM_EVENT for the state of the filter. Check that only one WM runs on the bus "          \
    "(`rcs top`).")                                                                                \
  X(kSpFacetRejected, "sp", "facet.rejected", kWarning, kOne,                                      \
    "A part of a scan was rejected.",                                                              \
    "Rows, columns, facet number, sensor_id or the counts of the message do not match [ladar] of " \
    "the configuration.",                                                                          \
    "Compare [ladar] with the driver of the LADAR (`rcs log list`, `rcs config show`).")           \
  X(kSpFacetStale, "sp", "facet.stale", kWarning, kOne,                                            \
    "A part of a scan was dropped.",                                                               \
    "The facet was received after the end of its scan, or twice.",                                 \
    "Check the order of the messages and the driver of the LADAR. A second publisher of the "      \
    "channel has the same effect.")                                                                \
  X(kSpScanClock, "sp", "scan.clock", kWarning, kOne,                                              \
    "The stamps of the LADAR stepped. SP corrects them.",                                          \
    "The clock of the LADAR or of its driver stepped, or lost its synchronization.",               \
    "Check the synchronization of the clock of the LADAR. The event is repeated when the stamps "  \
    "are usual again.")                                                                            \
  X(kSpScanIncomplete, "sp", "scan.incomplete", kWarning, kOne,                                    \
    "Parts of a scan are missing. The scan is registered if enough parts were received.",          \
    "Messages were lost between the driver and SP, or the LADAR or its driver was interrupted.",   \
    "Check the receive buffers of the computer (config/sysctl) and the gaps in `rcs top`. At the " \
    "end of a log the event is normal.")                                                           \
  X(kSpScanRepeated, "sp", "scan.repeated", kWarning, kOne,                                        \
    "A scan was rejected because it is the one before with a new stamp.",                          \
    "The LADAR or its driver is stuck, or repeats its last scan when none arrives.",               \
    "Restart the driver of the LADAR. A driver must be silent while it receives nothing.")         \
  X(kSpPointsNotFinite, "sp", "points.not_finite", kWarning, kOne,                                 \
    "Ranges or points of a scan were rejected. The other points of the scan are used.",            \
    "The driver of the LADAR publishes NaN or infinity.",                                          \
    "Correct the driver: a ray without a return has the range 0, or no point.")                    \
  X(kSpMapReseeded, "sp", "map.reseeded", kError, kOne,                                            \
    "The rolling map was discarded. The scan starts a new one, and a new map epoch. The motion "   \
    "between the two maps is known from the other sensors only.",                                  \
    "Several registrations in a row failed ([sp] reseed_after), or WM published no pose in the "   \
    "current map epoch.",                                                                          \
    "Check the scans (`registration.failed`) and the INS. After a restart of WM the event is "     \
    "normal.")                                                                                     \
  X(kSpDegrade, "sp", "degrade", kInfo, kOne,                                                      \
    "The degrade level changed: 1 registers fewer points, 2 also omits the match to the a priori " \
    "map, 3 holds the scan without a registration.",                                               \
    "The cycle started late, or the scan needs more time than is left before its deadline.",       \
    "If the level stays above 0, give SP more computing time: real-time priority "                 \
    "([process.sp]), fewer points, or a faster computer. `rcs budget` measures the latency.")      \
  X(kSpRegistrationFailed, "sp", "registration.failed", kWarning, kOne,                            \
    "A scan was not used: its registration to the rolling map has no usable result.",              \
    "Too few points match, the surroundings have too few features, or the predicted pose is too "  \
    "far off, e.g. because the INS is silent; or the scan contradicts the last one.",              \
    "A single event needs no action. If events follow each other, check the field of view of the " \
    "LADAR and its mounting, [ladar] mount_m and mount_rpy_deg.")                                  \
  X(kSpRegistrationRecovered, "sp", "registration.recovered", kWarning, kOne,                      \
    "A scan that matched little where it was predicted was found elsewhere in the rolling map.",   \
    "The predicted pose was wrong, e.g. after a gap of the INS or by a fault of it.",              \
    "A single event needs no action. If events follow each other, check the INS.")                 \
  X(kSpStartFound, "sp", "start.found", kInfo, kOne,                                               \
    "Initial localization on the a priori map has succeeded.",                                     \
    "Newly observed ground confirmed one candidate pose.",                                         \
    "None.")                                                                                       \
  X(kSpStartConfirming, "sp", "start.confirming", kInfo, kOne,                                     \
    "Initial localization has one candidate pose left, which is not used yet.",                    \
    "All other hypotheses have become unlikely.",                                                  \
    "Drive on: ground that has not been observed must confirm the candidate pose.")                \
  X(kSpStartUnknown, "sp", "start.unknown", kInfo, kOne,                                           \
    "Initial localization is unresolved. The text has the reason.",                                \
    "Too little ground was observed, the ground has too few features, several poses fit, no pose " \
    "fits, or the map has no data in the start region.",                                           \
    "Drive on over ground with relief. If no pose fits, check [start] and the map.")               \
  X(kMapTileFailed, "sp, wm", "map.tile_failed", kWarning, kOne,                                   \
    "A tile of the a priori map is not used. The ground there is unknown to the node.",            \
    "The file of the tile is missing, damaged or not readable, or it is not the file of the map's " \
    "index: it was changed, or the map was replaced while the node runs.",                         \
    "Check the map with `rcs map info` and copy it to the vehicle again. Restart the node after a " \
    "map has been replaced.")                         \
  X(kWmPathIssuer, "wm", "path_uncertainty.issuer", kWarning, kOne,                                \
    "A message on WM_PATH_QUERY was rejected.",                                                    \
    "The name of its issuer has more than 64 characters.",                                         \
    "Shorten the name in the program that publishes the query.")                                   \
  X(kWmInputRejected, "wm", "input.rejected", kWarning, kOne,                                      \
    "A measurement was not fused. The text has the channel and the reason.",                       \
    "The measurement is invalid (not finite, implausible, or far in the future), late (older than "\
    "the history of the filter) or repeated, or it belongs to another map epoch. Of the INS also: "\
    "eight equal increments in a row (frozen sensor), no specific force, a specific force that "   \
    "does not point upward (exchanged or inverted axes), or six equal values of one axis in a "    \
    "row (beyond its range). Of the wheels also: eight equal samples in a row while moving. Of "   \
    "GPS also: the same position to the last bit while the vehicle moves (a frozen receiver).",    \
    "Invalid, frozen or not upward: correct the driver. Saturated: choose a larger range of the "  \
    "sensor. Late: check the clock of the sensor, the latency of its driver and [wm.history]. At " \
    "the start of a run the event is normal.")                                                     \
  X(kWmMapNone, "wm", "map.none", kWarning, kOne,                                                  \
    "WM has no a priori map. The uncertainty along a path is predicted by dead reckoning only.",   \
    "The map of the configuration cannot be opened. The text has the reason.",                     \
    "Check [world] prior_map of the configuration and the folder of the map (`rcs map info`).")    \
  X(kWmMode, "wm", "mode", kInfo, kTen,                                                            \
    "The mode changed: the set of sources that support the belief.",                               \
    "A source became available, fell silent, was excluded, or was readmitted.",                    \
    "None for a single change. LOST: the pose is invalid, see `input.none` and the events of the " \
    "sources.")                                                                                    \
  X(kWmAlignment, "wm", "alignment.waiting", kWarning, kOne,                                       \
    "The alignment takes longer than usual. The text has what is missing: level, position or "     \
    "heading. Until then only the local pose is valid.",                                           \
    "Level: the vehicle moves since the start. Position: no GPS fix, and no match to the a "       \
    "priori map. Heading: the vehicle has not moved far enough, the sigma of the fixes is large "  \
    "for the distance, or nothing measures its velocity.",                                         \
    "As the text says: stand still, give the receiver a view of the sky, or drive with a turn.")   \
  X(kWmWorldReset, "wm", "world.reset", kWarning, kOne,                                            \
    "The pose in frame world stepped by more than [wm.modes] reset_m or reset_rad. Frame local "   \
    "does not step.",                                                                              \
    "GPS or the a priori map corrected an error that had accumulated, or fault detection "         \
    "replaced the belief. Severity info: the pose in frame world begins, which is normal after "   \
    "the start.",                                                                                  \
    "None if the step follows an outage. Otherwise compare GPS with the a priori map "             \
    "(`rcs why LOG TIME`).")                                                                       \
  X(kWmClockStep, "wm", "clock.step", kWarning, kOne,                                              \
    "The stamps of all sensors stepped. The belief continues at the new stamp.",                   \
    "The clock that stamps the sensors was set, or a log was started again.",                      \
    "Synchronize the clock of the sensors before the drive, and let it slew, not step.")           \
  X(kWmSolutionLost, "wm", "solution.lost", kError, kOne,                                          \
    "For two seconds the estimated velocity was one that no ground vehicle has: sideways, up or "  \
    "down by more than 5 m/s, or above 80 m/s. The solution is discarded: the pose in frame world "\
    "is invalid until GPS or the a priori map georeferences it again.",                            \
    "Several sources failed at once or one after the other, usually the INS during a GPS outage.", \
    "Look for the first `fde`, `input.*` or `registration.failed` event before it.")               \
  X(kWmResumed, "wm", "state.resumed", kWarning, kOne,                                             \
    "WM was started again and continues with the belief, frame local and the terrain of its "      \
    "predecessor, after another start of `rcs up` or a longer time with the terrain alone, or "    \
    "reports why it does not.",                                                                    \
    "The process ended or was restarted, the output of `rcs up` shows how; or the vehicle was "    \
    "moved meanwhile.",                                                                            \
    "None if it continues. Otherwise WM levels itself and finds its heading as at every start, "   \
    "and knows no terrain: look that nothing stands in the blind zone before the LADAR.")          \
  X(kWmMapEpoch, "wm", "map.epoch", kInfo, kOne,                                                   \
    "WM uses a new map epoch of the rolling map.",                                                 \
    "SP has started a new rolling map: at its start, or after `map.reseeded`.",                    \
    "None; see `map.reseeded` if SP was not restarted.")                                           \
  X(kWmInputIns, "wm", "input.ins", kWarning, kTen,                                                \
    "The INS has been silent for longer than its limit, or (severity info) is received again. "    \
    "Without the INS the belief follows GPS and the registrations.",                               \
    "Cable, power, driver or clock of the INS; or the bus lost messages.",                         \
    "Check the driver and `rcs top`. The vehicle stops when the pose becomes invalid.")            \
  X(kWmInputGps, "wm", "input.gps", kWarning, kTen,                                                \
    "No valid fix has been received for longer than the limit, or (severity info) fixes are "      \
    "received again.",                                                                             \
    "The receiver has no fix (sky view, jamming); or cable, power or driver of the receiver.",     \
    "Check the sky view, then the driver. The position drifts: see sigma_in_60s_m of "             \
    "WM_INTEGRITY.")                                                                               \
  X(kWmInputOdometry, "wm", "input.odometry", kWarning, kTen,                                      \
    "The odometry has been silent for longer than its limit, or (severity info) is received "      \
    "again.",                                                                                      \
    "Cable or driver of the odometry.",                                                            \
    "Check the driver.")                                                                           \
  X(kWmInputLadar, "wm", "input.ladar", kWarning, kTen,                                            \
    "The registrations of SP have been silent for longer than their limit, or (severity info) "    \
    "are received again.",                                                                         \
    "SP does not run, the LADAR is silent, or no registration has a usable result.",               \
    "Check SP_EVENT and the driver of the LADAR.")                                                 \
  X(kWmInputNone, "wm", "input.none", kError, kTen,                                                \
    "No sensor is received; or (severity info) inputs are received again. The mode becomes LOST "  \
    "and the pose invalid, and BG stops the vehicle.",                                             \
    "The bus is interrupted, or all drivers have stopped.",                                        \
    "Check the drivers, the network interface and the firewall of the bus (`rcs top`).")           \
  X(kWmClockIns, "wm", "clock.ins", kWarning, kOne,                                                \
    "The clock of the INS stepped against those of the other sensors. WM shifts its stamps.",      \
    "The INS was restarted or has synchronized its clock.",                                        \
    "Synchronize the sensors before the drive.")                                                   \
  X(kWmFde, "wm", "fde", kWarning, kTen,                                                           \
    "Fault detection excluded or (severity info) readmitted a source. The text has the source, "   \
    "the reason, the largest ratio of all tests (statistic over its limit) and the step of the "   \
    "belief.",                                                                                     \
    "Exclusion: the source contradicts the filter that does not use it: GPS multipath, spoofing "  \
    "or a wrong datum; an INS with a bias, a wrong scale or exchanged axes; a LADAR that is "      \
    "obstructed or moved; wheels that slip or a wrong scale; a survey that is wrong here.",        \
    "Continue with the other sources while the protection levels allow it. Check the excluded "    \
    "source: receiver and antenna, mounting of the INS or LADAR, wheel sensors, datum of the map.") \
  X(kWmPriorMapExcluded, "wm", "prior_map.excluded", kWarning, kOne,                               \
    "The matches to a tile of the a priori map are not fused.",                                    \
    "The low-passed NIS of the matches is above its limit: the terrain has changed since the "     \
    "survey, or the sigma of the survey is too small.",                                            \
    "Import the survey with a larger sigma, or build a newer map of the area (`rcs map build`).")  \
  X(kWmPriorMapReadmitted, "wm", "prior_map.readmitted", kInfo, kOne,                              \
    "The matches to the tile of the a priori map under the vehicle are fused again.",              \
    "The low-passed NIS has fallen below its lower limit, or the vehicle is on another tile.",     \
    "None.")                                                                                       \
  X(kWmAlert, "wm", "alert", kWarning, kTen,                                                       \
    "The set of alerts of WM_INTEGRITY changed. The text has all alerts with their reasons. "      \
    "Severity info: all alerts have ended.",                                                       \
    "Horizontal, vertical: a protection level exceeds its limit, or the position in frame world "  \
    "is invalid. INS, GPS, LADAR, odometry: the source is excluded, suspect (its test ratio is "   \
    "above 1), or its measurements were rejected at least three times in a row. Input: no sensor " \
    "is received.",                                                                                \
    "Horizontal, vertical: restore GPS or drive on mapped terrain with relief; the limits are "    \
    "[wm.integrity] limit_horizontal_m and limit_vertical_m. A source: see `fde` and "             \
    "`rcs why LOG TIME`, then check the sensor; none if the alert ends by itself. Input: see "     \
    "`input.none`.")                                                                               \
  X(kBgInputRejected, "bg", "input.rejected", kWarning, kOne,                                      \
    "A message of WM was rejected. BG uses the last valid message until it is too old.",           \
    "A pose, a velocity, a protection level or the size of a terrain patch is invalid.",           \
    "Check WM_EVENT. Check that all nodes are of one version of the software.")                    \
  X(kBgPathNone, "bg", "path.none", kWarning, kOne,                                                \
    "No path to the next waypoint was found. The vehicle follows the last path while it is free.", \
    "Obstacles, slopes or unknown ground enclose the vehicle or the waypoint.",                    \
    "Move the waypoint or add others around the obstacle. The limits of the ground are "           \
    "[bg.weights].")                                                                               \
  X(kBgPathBlocked, "bg", "path.blocked", kWarning, kOne,                                          \
    "The path was dropped and is excluded from the next search.",                                  \
    "The vehicle was at rest for too long because of an obstacle near its predicted arc.",         \
    "None if another path is found. Otherwise move the obstacle, or command another waypoint.")    \
  X(kBgObstacleLate, "bg", "obstacle.late", kWarning, kOne,                                        \
    "BG used the brake of the vehicle for an obstacle in its way.",                                \
    "The obstacle was detected so late that stopping before it needs more than "                   \
    "[bg.follow] firm_mps2: an edge, or something that moved into the way.",                       \
    "If it happens often: command a lower speed.")                                                 \
  X(kBgState, "bg", "state", kInfo, kTen,                                                          \
    "The state of BG changed. The text has both states and the reason.",                           \
    "A command, the belief of WM, the terrain or an emergency stop.",                              \
    "See docs/user/commanding.md for the states and what ends them.")                              \
  X(kBgStopEngaged, "bg", "stop.engaged", kWarning, kTen,                                          \
    "An emergency stop was engaged. The vehicle brakes and stays at rest until it is released.",   \
    "A command of an operator (`rcs go --emergency-stop`, DDS topic EmergencyStop).",              \
    "Make the vehicle safe, then release the stop at rest (`rcs go --release`).")                  \
  X(kBgStopRelease, "bg", "stop.release_failed", kError, kOne,                                     \
    "The emergency stop was not released and stays latched.",                                      \
    "The file of the latch was not removed, or not in time. The text has the reason.",             \
    "Check the permissions of [process] state_directory, then release again.")                     \
  X(kBgStopReleased, "bg", "stop.released", kInfo, kTen,                                           \
    "The emergency stop was released.",                                                            \
    "A release by an operator while the vehicle was at rest.",                                     \
    "None. A new command is required for the vehicle to move.")                                    \
  X(kBgStopLatched, "bg", "stop.latched", kWarning, kOne,                                          \
    "An emergency stop is latched since before the start of BG.",                                  \
    "BG was restarted while an emergency stop was in force.",                                      \
    "Release the stop at rest (`rcs go --release`).")                                              \
  X(kBgStopNotPersisted, "bg", "stop.not_persisted", kError, kOne,                                 \
    "The emergency stop is in force, but would be lost if BG restarts.",                           \
    "The file of the latch cannot be written: folder missing, disk full, or no permission.",       \
    "Do not restart BG. Check [process] state_directory; BG tries again every second.")            \
  X(kMissionInputRejected, "mission", "input.rejected", kWarning, kOne,                            \
    "A message of WM was rejected. The mission waits for the next valid one.",                     \
    "A pose, velocity or protection level is not finite or is implausible.",                       \
    "Check WM_EVENT for the state of the filter. Check that only one WM runs on the bus "          \
    "(`rcs top`).")                                                                                \
  X(kMissionState, "mission", "state", kInfo, kTen,                                                \
    "The state of the mission changed; the text has the reason.",                                  \
    "See the reason; docs/user/missions.md lists the states.",                                     \
    "None, unless the reason names a fault.")                                                      \
  X(kMissionRoute, "mission", "route.chosen", kInfo, kTen,                                         \
    "A route was chosen; the text has its values and those of its alternatives.",                  \
    "A new task, a blocked route, or GPS was lost.",                                               \
    "None.")                                                                                       \
  X(kMissionBlocked, "mission", "route.blocked", kWarning, kTen,                                   \
    "BG found no path along the route. The mission excludes the place and searches another "       \
    "route.",                                                                                      \
    "An obstacle that the a priori map does not have.",                                            \
    "None; if all routes are blocked the state is BLOCKED.")                                       \
  X(kGatewayUnsecured, "gateway", "dds.unsecured", kWarning, kOne,                                 \
    "DDS runs without keys: everyone on the network can command the vehicle.",                     \
    "[gateway] unsecured permits it.",                                                             \
    "Make keys (`rcs keys`) and name their folder in [gateway.security] directory.")               \
  X(kGatewaySecured, "gateway", "dds.secured", kInfo, kOne,                                        \
    "DDS runs with authentication and encryption. The text has the number of revoked "             \
    "certificates, or that there is no revocation list, and the end of the validity of the keys.", \
    "The gateway has started.",                                                                    \
    "None.")                                                                                       \
  X(kGatewayIdentityExpires, "gateway", "dds.identity_expires", kWarning, kOne,                    \
    "The validity of the vehicle's own keys ends within 30 days. Then no operator can command or " \
    "stop the vehicle over DDS. The event is repeated every day.",                                 \
    "The certificate, the permissions, the list of revoked certificates or an authority of the "   \
    "keys ends.",                                                                                  \
    "Renew the keys (`rcs keys FOLDER --renew VEHICLE`), copy them to the vehicle, and restart "   \
    "the gateway (docs/user/dds.md).")                                                             \
  X(kGatewayIdentityExpired, "gateway", "dds.identity_expired", kError, kOne,                      \
    "The validity of the vehicle's own keys has ended: no operator can command or stop the "       \
    "vehicle over DDS. The event is repeated every day.",                                          \
    "The keys were not renewed, or the clock of the computer is wrong.",                           \
    "Renew the keys (`rcs keys FOLDER --renew VEHICLE`), copy them to the vehicle, and restart "   \
    "the gateway (docs/user/dds.md). Check the clock of the computer.")                            \
  X(kGatewayCommandRejected, "gateway", "command.rejected", kWarning, kOne,                        \
    "A command of an operator was rejected. The text has the operator and the reason.",            \
    "The operator is not authorized, another operator is in command, an emergency stop is "        \
    "engaged, the id of the command is not greater than the last one, or a value is invalid.",     \
    "Correct the command and send it with a greater command_id (docs/user/dds.md).")               \
  X(kGatewayCommandIdle, "gateway", "command.idle", kInfo, kOne,                                   \
    "No command is in force.",                                                                     \
    "BG has accepted the release of the emergency stop.",                                          \
    "Send a new command.")                                                                         \
  X(kGatewayCommandGoto, "gateway", "command.goto", kInfo, kOne,                                   \
    "A waypoint command is in force.",                                                             \
    "The gateway accepted a command of an operator.",                                              \
    "None.")                                                                                       \
  X(kGatewayCommandDone, "gateway", "command.done", kInfo, kOne,                                   \
    "The command was completed.",                                                                  \
    "The vehicle has reached the last waypoint.",                                                  \
    "None.")                                                                                       \
  X(kGatewayCommandFailed, "gateway", "command.failed", kWarning, kOne,                            \
    "The command failed. The text has the reason that BG reports.",                                \
    "BG cannot execute the command, e.g. because there is no path or the pose is invalid.",        \
    "See the reason and BG_EVENT, then send a new command.")                                       \
  X(kGatewayOperatorSilent, "gateway", "operator.silent", kWarning, kOne,                          \
    "The command ended and the vehicle stops, because its operator is silent.",                    \
    "The operator's program has ended, or the network is interrupted.",                            \
    "Restore the connection and send a new command.")                                              \
  X(kGatewayCommandHalt, "gateway", "command.halt", kInfo, kOne,                                   \
    "A halt command is in force.",                                                                 \
    "The gateway accepted a halt command of an operator.",                                         \
    "None.")                                                                                       \
  X(kGatewayStopEngaged, "gateway", "stop.engaged", kWarning, kOne,                                \
    "The gateway received an emergency stop and passes it to BG.",                                 \
    "An operator published EmergencyStop with engage.",                                            \
    "Make the vehicle safe, then release the stop at rest.")                                       \
  X(kGatewayStopReleased, "gateway", "stop.released", kInfo, kOne,                                 \
    "The gateway received the release of the emergency stop and passes it to BG.",                 \
    "An operator published EmergencyStop without engage.",                                         \
    "Wait for `command.idle`: BG releases the stop at rest only.")                                 \
  X(kGatewayStateRejected, "gateway", "state.rejected", kWarning, kOne,                            \
    "A message on WM_NAV_STATE was rejected. VehicleState is not published.",                      \
    "The mode is unknown or a number is not finite.",                                              \
    "Check WM_EVENT. Check that all nodes are of one version of the software.")                    \
  X(kGatewayDdsWrite, "gateway", "dds.write", kWarning, kOne,                                      \
    "DDS rejected samples of the gateway. They are lost.",                                         \
    "A receiver is too slow or the network is interrupted.",                                       \
    "Check the network, and [gateway] interface.")                                                 \
  X(kRos2BridgeStarted, "ros2_bridge", "bridge.started", kInfo, kOne,                              \
    "The bridge to ROS 2 runs. The text has the DDS domain and the topics of both directions.",    \
    "The bridge has started.",                                                                     \
    "None.")                                                                                       \
  X(kRos2BridgeUnsecured, "ros2_bridge", "bridge.unsecured", kWarning, kOne,                       \
    "Every program in the ROS 2 domain can publish sensor data to the vehicle.",                   \
    "[ros2_bridge] has an input. DDS of ROS 2 runs without authentication here.",                  \
    "Use an interface that only trusted computers can reach, or remove the input.")                \
  X(kRos2BridgeOutputDropped, "ros2_bridge", "output.dropped", kWarning, kOne,                     \
    "Messages to ROS 2 were dropped. The text has their number and the reason.",                   \
    "The byte budget [ros2_bridge.output] max_kbytes_per_s is too small for the topics and "       \
    "their rates, a message is larger than the budget, or the bridge does not keep up with the "   \
    "bus.",                                                                                        \
    "Publish fewer topics, lower their rates, or raise the budget.")                               \
  X(kRos2BridgeDdsWrite, "ros2_bridge", "dds.write", kWarning, kOne,                               \
    "DDS rejected samples of the bridge. They are lost.",                                          \
    "A reliable reader is too slow, or the network is interrupted.",                               \
    "Check the network, [ros2_bridge] interface, and the subscribers.")                            \
  X(kRos2BridgeInputRejected, "ros2_bridge", "input.rejected", kWarning, kOne,                     \
    "A message from ROS 2 was rejected. The text has the topic, the reason and the number of "     \
    "rejected messages.",                                                                          \
    "The message is too large or malformed, its frame_id is another one, its stamp is in the "     \
    "future, too old or not later than the one before, a value is not finite, or a second "        \
    "publisher uses the topic.",                                                                   \
    "Compare [ros2_bridge] with the driver (`ros2 topic info -v`, `ros2 topic echo`). For "        \
    "stamps, check the clocks of the computers.")                                                  \
  X(kRos2BridgeInputFlood, "ros2_bridge", "input.flood", kWarning, kOne,                           \
    "Messages from ROS 2 were rejected because their rate is above max_rate_hz of the input.",     \
    "The driver publishes faster than the input permits, or the domain is flooded.",               \
    "Raise max_rate_hz if the rate is that of the sensor; otherwise stop the publisher.")          \
  X(kRos2BridgeInputRestarted, "ros2_bridge", "input.restarted", kWarning, kTen,                   \
    "An input from ROS 2 is accepted again with stamps before the previous ones.",                 \
    "The driver was restarted, its clock was set back, or a recording is played again.",           \
    "Check the clock of the driver. For a recording that is played again, the event is normal.")   \
  X(kRos2BridgeClockStep, "ros2_bridge", "clock.step", kWarning, kTen,                             \
    "The UTC clock of this computer stepped. The stamps of the messages to ROS 2 follow it.",      \
    "The clock was set, e.g. by NTP after the start.",                                             \
    "Start the vehicle after the clock is synchronized.")                                          \
  X(kBusRejected, "sp, wm, bg, mission, gateway, ros2_bridge", "bus.rejected", kWarning, kOne,              \
    "Datagrams on the port of the bus, or messages, were not delivered to this node.",             \
    "Malformed: a program that does not speak LCM, or an attack. Incomplete or lost: the kernel's " \
    "buffer is too small, or the computer is overloaded. Of other computers: the bus has ttl=0. "  \
    "Too many waited: the node was stopped, or the bus is flooded.",                               \
    "Set net.core.rmem_max (docs/user/vehicle_install.md) and the firewall of the bus. `rcs top` "  \
    "shows the load and the rates of the channels.")                                               \
  X(kPublisherRejected, "sp, wm, bg, mission, gateway, ros2_bridge", "publisher.rejected", kError, kOne,    \
    "Messages of a second publisher of a channel were rejected. BG brakes while this concerns a "  \
    "channel by which it drives.",                                                                 \
    "Two programs publish on one channel: a second driver or simulator, a node of another run, or " \
    "a recording that is played with the outputs of its nodes.",                                   \
    "Find the program by its publisher id and end it. `rcs top` shows the process ids and publisher " \
    "ids of all programs that publish `<NAME>_PROCESS`, and of a rejected publisher if it is one of " \
    "them. A driver is not: if it uses its process id as publisher id, `printf '%d' 0xID` prints "  \
    "it. `rcs log list` and the audit log have the ids of every message.")                          \
  X(kPublisherChanged, "sp, wm, bg, mission, gateway, ros2_bridge", "publisher.changed", kWarning, kTen,    \
    "A channel is accepted from another publisher than before, because the former one was silent.", \
    "A driver or a node was started again. Otherwise a second program has taken over the channel.", \
    "None after a restart. Otherwise see publisher.rejected: the text has the ids of both.")        \
  X(kUpNodeFailing, "up", "node.failing", kError, kOne,                                            \
    "A node ends again and again. The other nodes keep running, and the restarts continue.",       \
    "The text has how the node ended. Configuration, driver, memory, or a bug.",                   \
    "See the output of the node (`journalctl -u rcs`) and run it alone: `NODE CONFIG --check`.")   \
  X(kUpNodeRecovered, "up", "node.recovered", kInfo, kOne,                                         \
    "A node that failed before runs again.",                                                       \
    "The restart by `rcs up` succeeded.",                                                          \
    "None; find the cause of the failure.")                                                        \
  X(kUpRecorderEnded, "up", "recorder.ended", kWarning, kTen,                                      \
    "The recorder (`rcs up --record`) ended and is started again. Messages until then are not "    \
    "recorded.",                                                                                   \
    "The text has how it ended. The folder cannot be written, or a bug.",                          \
    "See the output of the recorder (`journalctl -u rcs`). Check the folder of the recording.")    \
  X(kRecordShed, "record", "record.shed", kWarning, kOne,                                          \
    "The oldest segments of the recording were deleted before the recording had reached its "      \
    "size.",                                                                                       \
    "The disk is full, or its free space is below the reserve of the recorder.",                   \
    "Copy recordings away and delete other files, or record with a smaller --size-mb.")            \
  X(kRecordStopped, "record", "record.stopped", kError, kTen,                                      \
    "Messages are not recorded. The vehicle is not affected. The event is repeated when the "      \
    "recording continues.",                                                                        \
    "The disk is full and nothing is left to delete, or it has errors. The text has the "          \
    "reason.",                                                                                     \
    "Free space on the disk, or replace it. The recorder tries again by itself.")                  \
  X(kRecordDropped, "record", "record.dropped", kWarning, kOne,                                    \
    "Messages were received and are missing in the recording.",                                    \
    "The disk is slower than the bus, so that too many messages waited for it.",                   \
    "Use a faster disk, or end other programs that write to it.")                                  \
  X(kRecordSlow, "record", "record.slow", kWarning, kOne,                                          \
    "A power failure could have cost more than a second of the recording.",                        \
    "The disk stores too slowly. The text has the time.",                                          \
    "Use a faster disk, or end other programs that write to it.")                                  \
  X(kRecordRejected, "record", "record.rejected", kWarning, kOne,                                  \
    "Messages were not recorded, because a log cannot hold them.",                                 \
    "The name of a channel is empty, too long or not printable, or a message has more than 16 "    \
    "MB.",                                                                                         \
    "Correct the program that publishes them.")                                                    \
  X(kRecordAudit, "record", "record.audit_lost", kError, kOne,                                     \
    "Lines of the audit log are lost: commands or refusals are missing in it.",                    \
    "The disk is full or has errors for long, or there are more commands than the disk can "       \
    "store.",                                                                                      \
    "Free space on the disk. Check who publishes on BG_COMMAND.")
// clang-format on

#define RCS_EVENT_CONSTANT(constant, publisher, code, severity, limit, meaning, cause, remedy) \
  inline constexpr Info constant{publisher, code,  Severity::severity, Limit::limit, meaning,  \
                                 cause,     remedy};
RCS_EVENTS(RCS_EVENT_CONSTANT)
#undef RCS_EVENT_CONSTANT

inline constexpr const Info* kAll[] = {
#define RCS_EVENT_ROW(constant, publisher, code, severity, limit, meaning, cause, remedy) \
  &(constant),
    RCS_EVENTS(RCS_EVENT_ROW)
#undef RCS_EVENT_ROW
};

}  // namespace rcs::event
