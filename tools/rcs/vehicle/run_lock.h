#pragma once
// At most one `rcs up` on a bus.

#include <string>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"

namespace rcs::cli {

/// The bus of an LCM address, whatever its spelling: "udpm://239.255.76.67:7667" for UDP, with the
/// defaults of LCM; of another kind the address without its options.
[[nodiscard]] std::string bus_name(const std::string& bus_url);

/// Held until the object or the process ends, whatever ends it: a name of the network namespace,
/// which is the reach of the bus, too. No file remains.
class RunLock {
 public:
  /// @param bus_url  of LCM; it is the bus_name() that is locked
  /// @return an error if another process holds the lock
  static Result<RunLock> take(const std::string& bus_url);

 private:
  explicit RunLock(FileHandle socket) : socket_(std::move(socket)) {}
  FileHandle socket_;
};

}  // namespace rcs::cli
