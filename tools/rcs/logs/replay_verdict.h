#pragma once
// Checks a replay: WM published poses, and the LADAR, the a priori map and the configured datum
// were used.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/terrain/map_index.h"

namespace rcs::cli {

/// Counts the messages on the bus of a replay and passes each to the next tap.
class ReplayVerdict final : public BusTap {
 public:
  explicit ReplayVerdict(BusTap* next) : next_(next) {}

  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override;

  [[nodiscard]] std::int64_t sensor_messages() const { return sensor_messages_; }

  /// Deviations of the replay from its configuration, one sentence each; empty: none.
  /// @param datum  as configured; nullopt: the first fix is the datum
  /// @param map    index of the configured a priori map; nullptr: no map
  [[nodiscard]] std::vector<std::string> faults(const std::optional<Geodetic>& datum,
                                                const MapIndex* map) const;

 private:
  void count(Stamp due, std::string_view channel, const std::uint8_t* data, std::size_t size);
  [[nodiscard]] std::string pose_fault() const;
  [[nodiscard]] std::string ladar_fault() const;
  [[nodiscard]] std::string datum_fault(const Geodetic& datum) const;
  [[nodiscard]] std::string map_fault(const MapIndex& map) const;

  BusTap* next_;
  std::optional<Stamp> begin_;  ///< of the replay
  std::int64_t sensor_messages_ = 0;
  std::int64_t poses_ = 0;
  std::int64_t ladar_messages_ = 0;
  std::int64_t scans_ = 0;       ///< scans with a result of SP
  std::int64_t registered_ = 0;  ///< to the rolling map
  std::string ladar_event_;      ///< last warning of SP
  std::optional<Geodetic> first_fix_;
  std::optional<Geodetic> world_datum_;
  std::vector<Vec3> course_;  ///< of the vehicle in frame world, about one point per metre
};

}  // namespace rcs::cli
