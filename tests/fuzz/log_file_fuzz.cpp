// libFuzzer: the bytes as an LCM event log. The reader must end, and account for every byte.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "rcs/node/log_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int fd = memfd_create("log", 0);
  RCS_CHECK(fd >= 0 && write(fd, data, size) == static_cast<ssize_t>(size));
  rcs::Result<rcs::LogReader> reader = rcs::LogReader::open("/proc/self/fd/" + std::to_string(fd));
  if (reader) {
    rcs::LogEvent event;
    while (reader->next(&event)) {
    }
  }
  close(fd);
  return 0;
}
