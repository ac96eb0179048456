#pragma once
// Checks of the messages of the nodes for any input; and further readers of messages besides SP, WM
// and BG.

#include <cstdint>
#include <memory>
#include <string_view>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/subfilter_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/local_bus.h"

namespace rcs::test {

/// Checks each message of a node and counts those after a moment.
class Statements {
 public:
  explicit Statements(Stamp count_from) : count_from_(count_from) {}

  void judge(Stamp due, std::string_view channel, const std::uint8_t* data, std::size_t size);

  int registrations = 0;  ///< to the rolling map
  int beliefs = 0;
  int drive_commands = 0;

 private:
  void judge(const registration_t& m, int count);
  void judge(const points_t& m, int count);
  void judge(const nav_state_t& m, int count);
  void judge(const innovation_t& m, int count);
  void judge(const integrity_t& m, int count);
  void judge(const subfilter_t& m, int count);
  void judge(const map_patch_t& m, int count);
  void judge(const drive_t& m, int count);
  void judge(const plan_t& m, int count);

  Stamp count_from_;
  bool clock_stepped_ = false;  // WM has reported a step since its last pose
  std::int64_t belief_utime_ = INT64_MIN;
  std::int64_t belief_published_ = INT64_MIN;
  std::int64_t drive_utime_ = INT64_MIN;
};

/// `rcs top`, the gateway's view of the vehicle and the simulated vehicle's commands.
class OtherReaders {
 public:
  /// @param channel  channel on which the packets arrive
  OtherReaders(LocalBus* bus, std::string_view channel);
  OtherReaders(const OtherReaders&) = delete;
  OtherReaders& operator=(const OtherReaders&) = delete;
  ~OtherReaders();

 private:
  struct Readers;
  std::unique_ptr<Readers> readers_;
};

}  // namespace rcs::test
