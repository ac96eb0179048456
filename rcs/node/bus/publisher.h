#pragma once
// Ids of the publisher in every message. They distinguish a second publisher of a channel, a
// recording among live messages, and a node of another run.

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs {

struct Publisher {
  /// Id of the run. Live: equal in all processes that one `rcs up` has started, and in those that
  /// were started without it since the computer was. In lockstep: a hash of the inputs and the
  /// configuration, so that the same log gives the same bytes. 0: not set.
  std::int64_t run_id = 0;
  /// Id of the process; in lockstep of the node.
  std::int64_t publisher_id = 0;
  /// boot_id() of the computer. 0 in lockstep, so that the same log gives the same bytes.
  std::int64_t boot_id = 0;
};

/// FNV-1a of `text`, continued from `hash`; never negative, as required of an id.
[[nodiscard]] constexpr std::int64_t id_of(std::string_view text, std::int64_t hash = 0) {
  auto h = 14695981039346656037ULL ^ static_cast<std::uint64_t>(hash);
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return static_cast<std::int64_t>(h >> 1);
}

/// A random positive number; 0 if the system has no random numbers.
[[nodiscard]] std::int64_t random_id();
/// Of the running operating system: another one after a restart of the computer.
[[nodiscard]] std::int64_t boot_id();

/// An id of a run or a publisher for people and documents: hexadecimal, "5b3c1d2e4f607182".
[[nodiscard]] std::string id_text(std::int64_t id);

/// `rcs up` passes the run's id to its nodes in this variable.
inline constexpr char kRunIdVariable[] = "RCS_RUN_ID";
/// Run id of the `rcs up` that started this process. Processes that are started one by one with one
/// configuration are one run as long as the computer is; with another one they are another run,
/// whose messages nodes reject.
/// @param config_hash  of the configuration's text; 0: a program without configuration
[[nodiscard]] std::int64_t live_run_id(std::int64_t config_hash);
/// Whether `rcs up` started this process.
[[nodiscard]] bool is_supervised();

}  // namespace rcs
