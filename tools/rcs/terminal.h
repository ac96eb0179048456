#pragma once
// Progress bar and Ctrl-C for commands that run long.

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs::cli {

/// Progress on stderr: on a terminal a bar, from the construction on, erased at the end; elsewhere
/// (the log of a CI job) a line every ten seconds.
class Progress {
 public:
  /// Steps of callers that know a share.
  static constexpr std::int64_t kSteps = 1000;

  Progress(std::string_view label, std::int64_t total);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void at(std::int64_t done);
  /// @param share  [0, 1] of a Progress of kSteps
  void at_share(double share) { at(static_cast<std::int64_t>(share * kSteps)); }

 private:
  std::string label_;
  std::int64_t total_;  // > 0
  bool on_terminal_;
  int shown_percent_ = -1;
  std::int64_t line_utime_;  // of the last line, or of the construction
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
