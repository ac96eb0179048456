#pragma once
// A program started by this one, which dies with it; its output comes by lines.

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
  /// A longer line comes in pieces, so that a program gone mad cannot fill the memory.
  static constexpr std::size_t kMaxLine = 2000;

  void add(std::string_view bytes, const Sink& sink);
  /// What waits for the end of its line.
  void flush(const Sink& sink);

 private:
  std::string line_;
};

/// In a process group of its own, so that Ctrl-C reaches only its parent, which then decides.
class ChildProcess {
 public:
  /// stdout and stderr come together; stdin is empty. That the program cannot be executed shows in
  /// its output and an exit status of 127.
  static Result<ChildProcess> start(const std::string& program,
                                    const std::vector<std::string>& arguments);
  ChildProcess(ChildProcess&&) noexcept = default;
  ChildProcess& operator=(ChildProcess&&) noexcept = default;
  ~ChildProcess() = default;

  [[nodiscard]] int pid() const { return pid_; }
  [[nodiscard]] int exit_fd() const { return exit_.get(); }      ///< readable when it has ended
  [[nodiscard]] int output_fd() const { return output_.get(); }  ///< -1 after the output's end

  void send_signal(int signal) const;
  /// Lines that have come, without waiting. Closes output_fd() at the end of the output.
  void read_output(const LineCutter::Sink& sink);
  /// None while it runs. Once only: afterwards the process is no more.
  [[nodiscard]] std::optional<Exit> collect();

 private:
  ChildProcess(int pid, FileHandle exit, FileHandle output)
      : pid_(pid), exit_(std::move(exit)), output_(std::move(output)) {}

  int pid_;
  FileHandle exit_;
  FileHandle output_;
  LineCutter cutter_;
};

/// `name` beside the running program, else in PATH.
[[nodiscard]] Result<std::string> find_program(const std::string& name);

/// "ended with status 1", "was killed by signal 11 (Segmentation fault)".
[[nodiscard]] std::string to_text(const Exit& exit);

}  // namespace rcs::cli
