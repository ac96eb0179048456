#pragma once
// A child process that ends with its parent; its output is read by lines.

#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "tools/rcs/vehicle/supervisor.h"

namespace rcs::cli {

/// Cuts a stream of bytes into lines.
class LineCutter {
 public:
  using Sink = std::function<void(std::string_view line)>;
  /// Longer lines are split, so that a faulty program cannot exhaust the memory.
  static constexpr std::size_t kMaxLine = 2000;

  void add(std::string_view bytes, const Sink& sink);
  /// The incomplete last line.
  void flush(const Sink& sink);

 private:
  std::string line_;
};

/// In its own process group, so that Ctrl-C reaches only the parent.
class ChildProcess {
 public:
  /// stdout and stderr are merged; stdin is empty. If the program cannot be executed, the output
  /// has the reason and the exit status is 127.
  static Result<ChildProcess> start(const std::string& program,
                                    const std::vector<std::string>& arguments);
  ChildProcess(ChildProcess&&) noexcept = default;
  ChildProcess& operator=(ChildProcess&&) noexcept = default;
  ~ChildProcess() = default;

  [[nodiscard]] int pid() const { return pid_; }
  [[nodiscard]] int exit_fd() const {
    return exit_.get();
  }  ///< readable after the end of the process
  [[nodiscard]] int output_fd() const { return output_.get(); }  ///< -1 after the end of the output

  void send_signal(int signal) const;
  /// Passes the available lines without waiting. Closes output_fd() at the end of the output.
  void read_output(const LineCutter::Sink& sink);
  /// @return nullopt while the process runs. Returns the exit once; the process is reaped then.
  [[nodiscard]] std::optional<Exit> collect();

 private:
  ChildProcess(int pid, FileHandle exit, FileHandle output)
      : pid_(pid), exit_(std::move(exit)), output_(std::move(output)) {}

  int pid_;
  FileHandle exit_;
  FileHandle output_;
  LineCutter cutter_;
};

/// The program `name` in the folder of the running program, else in PATH.
[[nodiscard]] Result<std::string> find_program(const std::string& name);

/// "ended with status 1", "was killed by signal 11 (Segmentation fault)".
[[nodiscard]] std::string to_text(const Exit& exit);

}  // namespace rcs::cli
