#pragma once
// Memory in which a node keeps what its successor continues with, if the process is killed and
// started again. `rcs up` owns it, so it outlives the node; a memory with a name outlives `rcs up`,
// too, until the computer is switched off. A process that is killed at any instruction leaves every
// record complete or invalid.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs {

/// `rcs up` passes the path of the memory to its nodes in this variable.
inline constexpr char kCheckpointVariable[] = "RCS_CHECKPOINT";

/// What a vehicle knew when its last process ended is of no use after this time.
inline constexpr Duration kCheckpointOutdated = from_seconds(600.0);

/// What the memory holds: one state, and rows that change one by one.
struct CheckpointLayout {
  std::size_t state_bytes = 0;
  std::size_t rows = 0;
  std::size_t row_bytes = 0;
  friend bool operator==(const CheckpointLayout& a, const CheckpointLayout& b) {
    return a.state_bytes == b.state_bytes && a.rows == b.rows && a.row_bytes == b.row_bytes;
  }
};

class CheckpointMemory {
 public:
  /// The memory that `rcs up` has given to this process, else none.
  /// Records of another program file, configuration or layout are discarded. Errors name the cause;
  /// a node can run without the memory.
  /// @param config_id  ParamFile::text_id()
  static Result<std::unique_ptr<CheckpointMemory>> of_this_process(const CheckpointLayout& layout,
                                                                   std::int64_t config_id);
  /// @param program  identifies the program file whose records are valid
  static Result<std::unique_ptr<CheckpointMemory>> open(const std::string& path,
                                                        const CheckpointLayout& layout,
                                                        std::uint64_t program);

  CheckpointMemory(const CheckpointMemory&) = delete;
  CheckpointMemory& operator=(const CheckpointMemory&) = delete;
  ~CheckpointMemory();

  /// `state` has layout.state_bytes, `row` layout.row_bytes.
  void write_state(const void* state);
  void write_row(std::size_t k, const void* row);
  /// Newest complete state. @return false: none
  bool read_state(void* state) const;
  /// @return false: never written, or killed while it was
  bool read_row(std::size_t k, void* row) const;
  void clear();

 private:
  CheckpointMemory(FileHandle file, std::byte* mapped, const CheckpointLayout& layout)
      : file_(std::move(file)), mapped_(mapped), layout_(layout) {}

  FileHandle file_;
  std::byte* mapped_;
  CheckpointLayout layout_;
};

/// Memory for the nodes of one run, and the value of kCheckpointVariable.
class CheckpointOwner {
 public:
  /// Memory that ends with this process.
  static Result<CheckpointOwner> create();
  /// Memory in a file of `folder`, which a later run of the same user finds again. One run has it
  /// at a time. Outdated files of this user's other vehicles are removed. Errors name the file and
  /// the cause.
  /// @param folder  in memory: kernels write files on a disk at moments of their own
  /// @param vehicle  no two vehicles share a memory: any text that names this one
  static Result<CheckpointOwner> open(const std::string& folder, const std::string& vehicle);
  [[nodiscard]] std::string path() const;
  /// At least once in kCheckpointOutdated: the memory is in use.
  void keep() const;

 private:
  FileHandle file_;
};

/// $RUNTIME_DIRECTORY (systemd), else /dev/shm.
[[nodiscard]] std::string checkpoint_folder();

}  // namespace rcs
