#pragma once
// How a long command talks to the person who started it.

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs::cli {

/// A bar on stderr when that is a terminal; silent otherwise. Erased at the end.
class Progress {
 public:
  Progress(std::string_view label, std::int64_t total);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void at(std::int64_t done);

 private:
  std::string label_;
  std::int64_t total_;
  bool visible_;
  int shown_percent_ = -1;
};

/// While it lives, Ctrl-C and SIGTERM set a flag, so that a command can end cleanly.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();

  [[nodiscard]] bool requested() const;
};

}  // namespace rcs::cli
