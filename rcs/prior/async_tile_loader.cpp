#include "rcs/prior/async_tile_loader.h"

#include <cerrno>
#include <future>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/node/process/realtime.h"
#include "rcs/node/process/worker_thread.h"

namespace rcs {

AsyncTileLoader::AsyncTileLoader(std::string map) : map_(std::move(map)) {
  RCS_CHECK(sem_init(&waiting_, 0, 0) == 0);
  std::promise<void> in_background;
  thread_ = worker_thread([this, &in_background] {
    (void)run_in_background();  // if refused: normal priority
    in_background.set_value();
    work();
  });
  in_background.get_future().wait();
}

AsyncTileLoader::~AsyncTileLoader() {
  stop_ = true;
  sem_post(&waiting_);
  thread_.join();
  sem_destroy(&waiting_);
}

bool AsyncTileLoader::start(const TileJob& job) {
  if (asked_ - taken_ == kMax) return false;
  jobs_[asked_ % kMax] = job;
  ++asked_;
  sem_post(&waiting_);  // makes the job visible to the thread: posting is a release
  return true;
}

bool AsyncTileLoader::finished(TileJob* job) {
  if (taken_ == done_.load(std::memory_order_acquire)) return false;
  *job = jobs_[taken_ % kMax];
  ++taken_;
  return true;
}

void AsyncTileLoader::work() {
  std::vector<std::uint8_t> buffer;
  for (std::size_t next = 0;; ++next) {
    while (sem_wait(&waiting_) != 0) RCS_CHECK(errno == EINTR);
    if (stop_) return;
    load_tile(map_, &buffer, &jobs_[next % kMax]);
    done_.store(next + 1, std::memory_order_release);
  }
}

}  // namespace rcs
