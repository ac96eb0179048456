#pragma once
// Parallel work.

#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace rcs::tools {

/// Calls work(k) for all k < count, each in its own thread.
inline void in_threads(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<std::thread> others;
  for (std::size_t k = 1; k < count; ++k) others.emplace_back(work, k);
  if (count > 0) work(0);
  for (std::thread& other : others) other.join();
}

}  // namespace rcs::tools
