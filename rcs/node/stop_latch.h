#pragma once
// An emergency stop that survives restarts of the process, of all processes and of the computer: it
// is latched while its file exists. The content of the file is for people only: an empty, truncated
// or damaged file is a latched stop, too, and no failure during writing can lose a stop.

#include <string>

#include "lcmtypes/rcs/command_t.hpp"
#include "rcs/base/result.h"
#include "rcs/node/params/params.h"

namespace rcs {

class StopLatch {
 public:
  /// In memory only, for replay and simulation in lockstep: no file is read or written.
  StopLatch() = default;

  /// Creates the folder of `path` if needed, and checks that files can be created in it.
  /// Latched if anything exists at `path`, or if that cannot be determined.
  static Result<StopLatch> open(const std::string& path);

  [[nodiscard]] bool engaged() const { return engaged_; }
  /// persist() has nothing left to do.
  [[nodiscard]] bool persisted() const { return !engaged_ || path_.empty() || persisted_; }
  [[nodiscard]] const std::string& path() const { return path_; }  ///< empty: in memory only
  /// Cause for people: issuer and serial of the stop, or why it is treated as latched.
  [[nodiscard]] const std::string& cause() const { return cause_; }

  /// Latches in memory, at once. If already latched, only checks that the file still exists: if it
  /// does not, persist() must create it again.
  void engage(const command_t& stop);
  /// Creates the file and waits until it is on the disk. Errors name the file and the cause; then
  /// the stop is latched in memory alone, and this can be called again.
  Outcome persist();
  /// Removes the file and waits until the removal is on the disk. After an error the stop is
  /// latched as before.
  Outcome release();

 private:
  std::string path_;
  std::string cause_;
  bool engaged_ = false;
  bool persisted_ = false;
};

/// The folder of a vehicle's state: [process] state_directory (relative to the configuration), else
/// $STATE_DIRECTORY (systemd), $XDG_STATE_HOME/rcs or $HOME/.local/state/rcs. Empty: none is known.
[[nodiscard]] Result<std::string> state_folder(const ParamFile& file);

/// Opens the latch of a vehicle's configuration, in its state_folder().
/// The file's name has the configuration's stem and a hash of its absolute path, so that no two
/// configurations share a file. Errors name the folder and the key.
[[nodiscard]] Result<StopLatch> open_stop_latch(const ParamFile& file);

}  // namespace rcs
