#pragma once
// Selects from the messages of the bus what the audit log contains: commands, stops and releases
// with their issuers, queries, the events of operators, commands and stops (refusals included),
// each change of the status that BG, or the mission, reports of a command, and commands that it
// does not echo. One JSON object is one line. Commands and queries of an issuer, its stops and
// releases, and the events of a channel are each limited in rate (issuer_limit.h).

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"
#include "tools/recorder/issuer_limit.h"

namespace rcs::recorder {

class AuditTrail {
 public:
  /// BG echoes a command that it accepts in its next status, 50 ms later.
  static constexpr Duration kEchoWithin = std::chrono::seconds(2);
  /// Between two lines about commands that were not listed.
  static constexpr Duration kReportEvery = std::chrono::seconds(5);
  /// Characters of a name; the rest is cut.
  static constexpr std::size_t kMaxName = 64;
  /// Characters of a text, e.g. of a reason.
  static constexpr std::size_t kMaxText = 1000;

  /// The first line of a recorder: what was published before is not in the log.
  [[nodiscard]] static std::string begin_line(Stamp wall, std::string_view bus);
  /// The last line of a recorder that was ended.
  [[nodiscard]] static std::string end_line(Stamp wall);

  /// Call it for every message of the bus.
  /// @param wall  wall clock of the receipt
  /// @return the lines to store; most messages have none, and a command that is sent again has none
  [[nodiscard]] std::vector<std::string> on_message(Stamp wall, std::string_view channel,
                                                    const std::uint8_t* data, std::size_t size);

 private:
  /// What identifies a command; a command that is sent again has the same.
  struct Identity {
    std::int64_t serial = 0;
    std::int64_t utime = 0;
    std::int64_t publisher_id = 0;
  };
  /// Commands of an issuer that BG, or the mission, has not echoed.
  struct Unconfirmed {
    Stamp since;
    std::int64_t commands = 0;
    std::int64_t first_serial = 0;
    std::int64_t serial = 0;  ///< of the newest
  };

  void on_command(Stamp wall, std::string_view channel);
  void on_query(Stamp wall);
  void on_event(Stamp wall, std::string_view channel);
  void on_status(Stamp wall, std::string_view channel);
  void report_unconfirmed(Stamp wall);
  void report_unlisted(Stamp wall);
  template <class T>
  [[nodiscard]] bool read(const std::uint8_t* data, std::size_t size, T* message);
  [[nodiscard]] bool is_new(const std::string& key, const Identity& identity);

  // Of issuers with a limit of their own; by channel, kind and issuer.
  std::map<std::string, Identity> newest_;
  std::map<std::pair<std::string, std::string>, Unconfirmed> unconfirmed_;  // by status, issuer
  std::array<std::string, 2> status_keys_;  // of the last status line of BG, of the mission
  // Separate: a flood of commands must not leave a stop unlisted.
  IssuerLimit commands_limit_;
  IssuerLimit stops_limit_;
  IssuerLimit events_limit_;
  std::int64_t too_large_ = 0;  // messages since they were reported
  Stamp unlisted_reported_ = Stamp::min();
  std::vector<std::string> lines_;

  command_t command_{};
  path_query_t query_{};
  event_t event_{};
  status_t status_{};
};

}  // namespace rcs::recorder
