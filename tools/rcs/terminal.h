#pragma once
// Progress bar and Ctrl-C for commands that run long.

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs::cli {

/// A bar on stderr if stderr is a terminal; no output otherwise. Erased at the end.
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

/// During its lifetime Ctrl-C and SIGTERM set a flag, so that a command can end cleanly.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();

  [[nodiscard]] bool requested() const;
};

/// True after a signal that a guard has caught, or after note_interrupt(). A command that fails
/// then ends with status 130.
[[nodiscard]] bool was_interrupted();

/// For a command that receives its signals in another way.
void note_interrupt();

}  // namespace rcs::cli
