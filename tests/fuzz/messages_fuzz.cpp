// libFuzzer: the bytes as each message type in turn. A decoder must neither die nor allocate out of
// proportion; what it takes, it must be able to write again.

#include <cstdint>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/check.h"

namespace {

// The first 8 bytes are the type's fingerprint: given, or no input would get past them.
template <class T>
void decode(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> bytes(8 + size);
  const auto hash = static_cast<std::uint64_t>(T::getHash());
  for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(hash >> (56 - 8 * i));
  std::copy(data, data + size, bytes.begin() + 8);
  T message{};
  const int length = message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
  if (length < 0) return;
  std::vector<std::uint8_t> again(static_cast<std::size_t>(message.getEncodedSize()));
  RCS_CHECK(message.encode(again.data(), 0, static_cast<int>(again.size())) ==
            static_cast<int>(again.size()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > 65536) return 0;
  using Decode = void (*)(const std::uint8_t*, std::size_t);
  static constexpr Decode kTypes[] = {
      decode<rcs::command_t>,   decode<rcs::cycle_t>,        decode<rcs::drive_t>,
      decode<rcs::event_t>,     decode<rcs::gps_fix_t>,      decode<rcs::innovation_t>,
      decode<rcs::ins_t>,       decode<rcs::ladar_points_t>, decode<rcs::ladar_ranges_t>,
      decode<rcs::map_patch_t>, decode<rcs::nav_state_t>,    decode<rcs::odometry_t>,
      decode<rcs::plan_t>,      decode<rcs::points_t>,       decode<rcs::registration_t>,
      decode<rcs::status_t>,    decode<rcs::truth_t>};
  kTypes[data[0] % std::size(kTypes)](data + 1, size - 1);
  return 0;
}
