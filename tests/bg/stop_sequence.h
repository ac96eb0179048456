#pragma once
// Random command sequences around emergency stops, and the law that BG must keep in them: in
// lockstep (stop_sequences_test.cpp) and with a whole live vehicle (stop_sequences_test.cpp).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"

namespace rcs::bg::test {

/// What happens next.
struct DrawnEvent {
  enum class Kind { kNothing, kSend, kKill };
  Kind kind = Kind::kNothing;
  command_t command{};
  std::string what;  ///< "release of tablet with a wrong id"
};

/// Draws the events of a sequence from its seed: stops and releases of several issuers, kills, and
/// expired, replayed, forged and future commands.
class SequenceDraw {
 public:
  /// A valid command that is issued now; a release names the stops that BG lists.
  using Issue = std::function<command_t(std::int8_t kind, const std::string& issuer)>;
  /// Fewer than the latch of BG lists: further ones would be one stop without a name.
  static constexpr std::size_t kMaxStops = 10;

  SequenceDraw(unsigned seed, std::vector<std::string> issuers, Issue issue)
      : random_(seed), issuers_(std::move(issuers)), issue_(std::move(issue)) {}

  [[nodiscard]] int below(int n) { return std::uniform_int_distribution<>(0, n - 1)(random_); }
  /// @param stops  number of stops in force
  [[nodiscard]] DrawnEvent draw(std::size_t stops);
  /// A message that was sent may be replayed later.
  void remember(const command_t& m) { sent_.push_back(m); }

 private:
  [[nodiscard]] DrawnEvent fresh(std::int8_t kind);
  [[nodiscard]] DrawnEvent replay();
  [[nodiscard]] DrawnEvent of_the_future(std::size_t stops);
  [[nodiscard]] std::int8_t one_of(const std::vector<std::int8_t>& kinds) {
    return kinds[static_cast<std::size_t>(below(static_cast<int>(kinds.size())))];
  }

  std::mt19937 random_;
  std::vector<std::string> issuers_;
  Issue issue_;
  std::vector<command_t> sent_;
};

/// The stops that must be in force, from the messages on the bus. Only a release in time and at
/// rest, by the issuer of a stop or by an authority, ends it.
class StopLaw {
 public:
  /// @param release_within  longest time from a release to its effect
  StopLaw(std::string authority, Duration release_within)
      : authority_(std::move(authority)), release_within_(release_within) {}

  /// A command on the bus, in the order of arrival.
  void take(const command_t& m, Stamp arrival);
  /// BG, or the computer, has been restarted: what had not been persisted is lost.
  /// @param may_have_acted  on releases whose effect it has not reported
  void restarted(std::int64_t boot_id, bool may_have_acted);
  /// A status of BG, after the commands that it has received.
  void take(const status_t& m, Stamp now, bool at_rest);

  struct Stop {
    std::string issuer;
    bool listed = false;     ///< BG has listed it
    bool persisted = false;  ///< and it is in the file
  };
  [[nodiscard]] const std::map<std::int64_t, Stop>& in_force() const { return in_force_; }
  /// Released since BG was started: copies of it are ignored.
  [[nodiscard]] bool released(std::int64_t id) const { return released_.count(id) != 0; }
  /// Ids of stops that the newest status does not list any more, without a release.
  [[nodiscard]] const std::vector<std::int64_t>& lost() const { return lost_; }
  [[nodiscard]] int releases() const { return releases_; }

 private:
  struct Pending {
    command_t message;
    Stamp until;
  };
  [[nodiscard]] bool permits(const command_t& release, const Stop& stop) const;
  [[nodiscard]] bool has_release_of(std::int64_t id, const Stop& stop) const;

  std::string authority_;
  Duration release_within_;
  std::int64_t boot_id_ = 0;
  std::map<std::int64_t, Stop> in_force_;
  std::set<std::int64_t> released_;
  std::set<std::pair<std::string, std::int64_t>> seen_;  // releases, by issuer and serial
  std::vector<Pending> pending_;
  std::vector<std::int64_t> lost_;
  int releases_ = 0;
};

}  // namespace rcs::bg::test
