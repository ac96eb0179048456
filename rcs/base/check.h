#pragma once
// RCS_CHECK(condition): a bug of this program aborts the process and prints the source location.
// Never for input.

#include <cstdio>
#include <cstdlib>

namespace rcs {

[[noreturn]] inline void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: bug: the check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace rcs

#define RCS_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::rcs::check_failed(#condition, __FILE__, __LINE__))
