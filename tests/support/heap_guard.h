#pragma once
// Counts the heap allocations of this thread, to verify that a cycle makes none. It replaces malloc
// and its relatives in the test program; operator new ends there as well.

#include <cstdint>

namespace rcs::test {

/// While a guard exists, the allocations of this thread are counted. Guards must not be nested.
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
