#include "tests/support/heap_guard.h"

#include <cerrno>
#include <cstddef>

#include "rcs/base/check.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RCS_SANITIZER_OWNS_MALLOC 1
#endif
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define RCS_SANITIZER_OWNS_MALLOC 1
#endif
#endif

namespace {

// Plain integers with constant initialization: reading them in malloc does not allocate.
thread_local bool t_counting = false;
thread_local std::int64_t t_allocations = 0;

}  // namespace

#ifndef RCS_SANITIZER_OWNS_MALLOC

extern "C" {

// NOLINTBEGIN(bugprone-reserved-identifier): glibc's names of the replaced functions
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t size) {
  if (t_counting) ++t_allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  if (t_counting) ++t_allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* old, std::size_t size) {
  if (t_counting) ++t_allocations;
  return __libc_realloc(old, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  if (t_counting) ++t_allocations;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }

int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out != nullptr ? 0 : ENOMEM;
}
}

#endif

namespace rcs::test {

HeapGuard::HeapGuard() {
  RCS_CHECK(!t_counting);
  t_allocations = 0;
  t_counting = true;
}

HeapGuard::~HeapGuard() { t_counting = false; }

std::int64_t HeapGuard::allocations() const { return t_allocations; }

bool HeapGuard::available() {
#ifdef RCS_SANITIZER_OWNS_MALLOC
  return false;
#else
  return true;
#endif
}

}  // namespace rcs::test
