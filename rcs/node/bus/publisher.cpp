#include "rcs/node/bus/publisher.h"

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>

#include "rcs/base/file_handle.h"

namespace rcs {

std::int64_t random_id() {
  std::int64_t id = 0;
  if (getrandom(&id, sizeof(id), 0) != sizeof(id)) return 0;
  return id & std::numeric_limits<std::int64_t>::max();
}

std::int64_t boot_id() {
  const FileHandle file(::open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC));
  std::array<char, 64> text{};
  const ssize_t n = file.valid() ? read(file.get(), text.data(), text.size()) : 0;
  return id_of({text.data(), static_cast<std::size_t>(std::max<ssize_t>(n, 0))});
}

}  // namespace rcs
