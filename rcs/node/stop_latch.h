#pragma once
// The emergency stops in force. They survive restarts of the process, of all processes and of the
// computer: they are listed in a file whose existence is the latch (rcs/node/stop_file.h). A stop
// is in force at once; the file follows, and a release takes effect after the file is gone.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/stop_t.hpp"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/params/params.h"
#include "rcs/node/stop_writer.h"

namespace rcs {

class StopLatch {
 public:
  /// A superior that stops on behalf of others is the issuer "superior:other".
  static constexpr char kOnBehalf = ':';
  /// The superior has set it, for itself or on behalf of others.
  [[nodiscard]] static bool is_of(const stop_t& stop, std::string_view superior);
  /// Further stops are one stop without a name.
  static constexpr std::size_t kMaxStops = 16;
  static constexpr Duration kTryAgain = from_seconds(1.0);  ///< after a failed attempt to write

  /// In memory only, for replay and simulation in lockstep: no file is read or written.
  StopLatch() = default;

  /// Creates the folder of `path` if needed, and checks that files can be created in it.
  /// Latched if anything exists at `path`, or if that cannot be determined. step() waits for the
  /// disk.
  static Result<StopLatch> open(const std::string& path);
  /// Before the first step(). By a StopWriterThread, step() never waits for the disk.
  void use(std::unique_ptr<StopWriter> writer) { writer_ = std::move(writer); }

  [[nodiscard]] bool engaged() const { return !stops_.empty(); }
  /// All stops are listed in the file, and it is on the disk.
  [[nodiscard]] bool persisted() const;
  /// All stops have been released, and their file is being removed.
  [[nodiscard]] bool releasing() const { return releasing_; }
  [[nodiscard]] const std::vector<stop_t>& stops() const { return stops_; }
  [[nodiscard]] const std::string& path() const { return path_; }  ///< empty: in memory only
  /// Cause for people: the issuers of the stops, or why there is one without a name.
  [[nodiscard]] std::string cause() const;

  /// In force at once. A stop that is in force already only makes step() check that the file still
  /// exists.
  /// @param stop  id 0: without a name
  void engage(const stop_t& stop);

  enum class Release {
    kNone,  ///< no stop has these ids, or only those of others
    kSome,  ///< others stay in force
    kAll    ///< step() reports the end
  };
  /// Ends the stops with these ids that `by` has set; by an authority, whoever has set them. The
  /// last ones stay in force until their file has been removed; after `until` the release has
  /// failed.
  Release release(const std::vector<std::int64_t>& ids, std::string_view by, bool authority,
                  Stamp until);

  struct Step {
    enum class Event {
      kNone,
      kReleased,     ///< no stop is in force any more
      kNotReleased,  ///< the stops stay in force
      kNotWritten    ///< in force, but lost on a restart; it is tried again
    };
    Event event = Event::kNone;
    std::string trouble;  ///< names the file and the cause
  };
  /// Once a cycle: begins to write what has changed, and reports what has ended.
  Step step(Stamp now);
  /// At the end of the process, instead of further steps: waits for the disk, so that no stop in
  /// force is missing there.
  void finish();

  /// Ids of the stops that were released since the last call.
  [[nodiscard]] std::vector<std::int64_t> take_released();

 private:
  Step collect(Stamp now);
  void begin_job(Stamp now);
  void note_change();

  std::string path_;
  std::unique_ptr<StopWriter> writer_;
  std::vector<stop_t> stops_;
  std::string damage_;  // why one of them has no name
  std::string text_;    // of the file that lists them
  std::vector<std::int64_t> released_;

  bool releasing_ = false;
  Stamp release_until_ = Stamp::min();

  std::string on_disk_;  // empty: no file
  bool on_disk_known_ = true;
  bool check_ = false;  // whether the file still exists
  bool writing_ = false;
  std::string writing_text_;
  Stamp next_try_ = Stamp::min();
};

/// The folder of a vehicle's state: [process] state_directory (relative to the configuration), else
/// $STATE_DIRECTORY (systemd), $XDG_STATE_HOME/rcs or $HOME/.local/state/rcs. Empty: none is known.
[[nodiscard]] Result<std::string> state_folder(const ParamFile& file);

/// The file of the latch of a vehicle's configuration, in its state_folder(). Its name has the
/// configuration's stem and a hash of its absolute path, so that no two configurations share a
/// file. Errors name the key.
[[nodiscard]] Result<std::string> stop_latch_path(const ParamFile& file);

/// Opens the latch of a vehicle's configuration. Errors name the folder and the key.
[[nodiscard]] Result<StopLatch> open_stop_latch(const ParamFile& file);

}  // namespace rcs
