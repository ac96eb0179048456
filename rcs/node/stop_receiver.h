#pragma once
// The emergency stops of a subordinate. They have a receiver and a channel of their own, so that no
// number of other commands can displace one before it is read. A stop is recognized by its id, in
// whatever messages it is repeated.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/stop_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"

namespace rcs {

/// Id of the stop in a command; without a valid one, a hash of issuer, serial and stamp. Never 0.
[[nodiscard]] std::int64_t stop_id_of(const command_t& stop);

class StopReceiver final : public Receiver {
 public:
  static constexpr std::size_t kMaxIssuer = 64;  ///< characters; a longer name is cut
  /// Further stops that arrive in one cycle are one stop with id 0.
  static constexpr std::size_t kMaxArrived = 16;

  /// A stop on the channel of the other commands is accepted, too.
  StopReceiver(Bus* bus, std::string_view stop_channel, std::string_view command_channel);
  StopReceiver(const StopReceiver&) = delete;
  StopReceiver& operator=(const StopReceiver&) = delete;
  ~StopReceiver() = default;

  /// Once a cycle: accepts what has arrived.
  /// @return the newest stop, preferably one that is no copy; null: none has arrived
  const command_t* take();
  /// The stop that the newest take() returned is no copy of one that was accepted before.
  [[nodiscard]] bool took_new() const { return took_new_; }
  /// All stops of the newest take(), also the copies of stops that are in force.
  [[nodiscard]] const std::vector<stop_t>& taken() const { return taken_; }
  /// Later copies of these stops are ignored.
  void release(const std::vector<std::int64_t>& ids);

  /// Arrival of the newest stop that was not a copy (node time); a release issued before is
  /// rejected.
  [[nodiscard]] Stamp last_arrival() const { return last_arrival_; }

  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override;

 private:
  struct Record {
    std::int64_t id = 0;  ///< 0: unused
    bool released = false;
  };
  void accept(Stamp arrival);
  void note(std::int64_t id, bool released);
  [[nodiscard]] Record* find(std::int64_t id);

  command_t scratch_{};
  command_t newest_{};
  bool pending_ = false;
  bool pending_new_ = false;  // newest_ is no copy
  bool took_new_ = false;
  command_t taken_command_{};
  std::vector<stop_t> arrived_;
  std::vector<stop_t> taken_;
  Stamp last_arrival_ = Stamp::min();
  // A copy of a stop whose record was displaced stops the vehicle again, which is the safe side.
  std::array<Record, 64> records_;
  std::size_t next_record_ = 0;
};

}  // namespace rcs
