#include "rcs/node/bus/publisher.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <string>

#include "rcs/base/file_handle.h"

namespace rcs {
namespace {

std::int64_t given_run_id() {
  const char* given = std::getenv(kRunIdVariable);  // NOLINT(concurrency-mt-unsafe)
  return given == nullptr ? 0 : std::max<std::int64_t>(0, std::strtoll(given, nullptr, 10));
}

}  // namespace

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

std::string id_text(std::int64_t id) { return fmt::format("{:x}", static_cast<std::uint64_t>(id)); }

bool is_supervised() { return given_run_id() > 0; }

std::int64_t live_run_id(std::int64_t config_hash) {
  const std::int64_t given = given_run_id();
  if (given > 0) return given;
  const std::int64_t boot = boot_id();
  return config_hash == 0 ? boot : id_of(std::to_string(config_hash), boot);
}

}  // namespace rcs
