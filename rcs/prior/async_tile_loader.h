#pragma once
// Loads map tiles from disk while the vehicle drives, in a background thread (ADR 54).

#include <semaphore.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "rcs/terrain/tile_loader.h"

namespace rcs {

/// A background thread reads and decodes the files. start() and finished() never wait for it, lock
/// or allocate, except for the text of a failure. For one caller.
class AsyncTileLoader final : public TileLoader {
 public:
  /// @param map  the map's folder
  explicit AsyncTileLoader(std::string map);
  ~AsyncTileLoader() override;  ///< waits for the tile in progress
  AsyncTileLoader(const AsyncTileLoader&) = delete;
  AsyncTileLoader& operator=(const AsyncTileLoader&) = delete;

  [[nodiscard]] bool start(const TileJob& job) override;
  [[nodiscard]] bool finished(TileJob* job) override;

 private:
  static constexpr std::size_t kMax = 8;  ///< in progress or not yet collected

  void work();

  std::string map_;
  // A ring: slots [taken_, done_) are finished, [done_, asked_) belong to the thread.
  std::array<TileJob, kMax> jobs_;
  std::size_t asked_ = 0;  // the caller's
  std::size_t taken_ = 0;  // the caller's
  std::atomic<std::size_t> done_{0};
  std::atomic<bool> stop_{false};
  sem_t waiting_{};  // jobs requested and not begun
  std::thread thread_;
};

}  // namespace rcs
