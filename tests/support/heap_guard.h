#pragma once
// Counts the heap allocations of this thread, to prove that a cycle makes none. It replaces malloc
// and its relatives in the test program; operator new ends there as well.

#include <cstdint>

namespace rcs::test {

/// While one is alive, this thread's allocations are counted. Not to be nested.
class HeapGuard {
 public:
  HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;
  ~HeapGuard();

  [[nodiscard]] std::int64_t allocations() const;

  /// False where a sanitizer owns malloc: the test must skip, loudly.
  [[nodiscard]] static bool available();
};

}  // namespace rcs::test
