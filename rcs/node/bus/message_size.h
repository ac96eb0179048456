#pragma once
// The largest messages that nodes accept. A text or an array of a message may have any length on
// the bus, and what receives a message keeps its memory.

#include <cstddef>

namespace rcs {

class ladar_points_t;
class ladar_ranges_t;
class map_patch_t;
class plan_t;
class points_t;
class routes_t;

/// Encoded bytes; larger messages of the type are rejected unread. Most types have names and short
/// lists only: a command of 64 waypoints has 2 kB, a query of 1000 places 16 kB.
template <class T>
inline constexpr std::size_t kMaxEncodedBytes = std::size_t{64} << 10;
// A driver may publish a whole sweep as one message: 128 rows of 2048 points of 20 bytes.
template <>
inline constexpr std::size_t kMaxEncodedBytes<ladar_points_t> = std::size_t{8} << 20;
template <>
inline constexpr std::size_t kMaxEncodedBytes<ladar_ranges_t> = std::size_t{8} << 20;
// 20,000 points.
template <>
inline constexpr std::size_t kMaxEncodedBytes<points_t> = std::size_t{256} << 10;
template <>
inline constexpr std::size_t kMaxEncodedBytes<plan_t> = std::size_t{256} << 10;
template <>
inline constexpr std::size_t kMaxEncodedBytes<routes_t> = std::size_t{256} << 10;
// 512 x 512 cells of 7 bytes.
template <>
inline constexpr std::size_t kMaxEncodedBytes<map_patch_t> = std::size_t{2} << 20;

}  // namespace rcs
