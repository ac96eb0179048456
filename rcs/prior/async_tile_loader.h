#pragma once
// Map tiles from disk while the vehicle drives: the one thread of a process beside its cycles.

#include <semaphore.h>

#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "rcs/terrain/tile_loader.h"

namespace rcs {

/// Files are read and decoded by a thread in the background, which no cycle waits for; start() and
/// finished() never wait for it, lock or allocate, but for the text of a failure. For one caller.
class AsyncTileLoader final : public TileLoader {
 public:
  /// @param map  the map's folder
  explicit AsyncTileLoader(std::string map);
  ~AsyncTileLoader() override;  ///< waits for the tile under way
  AsyncTileLoader(const AsyncTileLoader&) = delete;
  AsyncTileLoader& operator=(const AsyncTileLoader&) = delete;

  [[nodiscard]] bool start(const TileJob& job) override;
  [[nodiscard]] bool finished(TileJob* job) override;

 private:
  static constexpr std::size_t kMost = 8;  ///< under way or not yet taken

  void work();

  std::string map_;
  // A ring: slots [taken_, done_) are finished, [done_, asked_) are the thread's.
  std::array<TileJob, kMost> jobs_;
  std::size_t asked_ = 0;  // the caller's
  std::size_t taken_ = 0;  // the caller's
  std::atomic<std::size_t> done_{0};
  std::atomic<bool> stop_{false};
  sem_t waiting_{};  // as many as are asked for and not begun
  std::thread thread_;
};

}  // namespace rcs
