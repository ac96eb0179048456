#include "tools/rcs/vehicle/private_bus.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

namespace rcs::cli {
namespace {

// Also set by the launcher of the tests, which creates such a bus for a whole test.
constexpr char kInside[] = "RCS_PRIVATE_BUS";
constexpr char kRoute[] =
    "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo";

std::vector<std::string> own_arguments() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  std::vector<std::string> arguments;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\0', from), text.size());
    arguments.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return arguments;
}

}  // namespace

Outcome enter_private_bus() {
  if (std::getenv(kInside) != nullptr) return Done{};  // NOLINT(concurrency-mt-unsafe)
  // Root keeps its scheduling privileges without a user namespace; other users need one.
  std::vector<std::string> ways = {"-rn"};
  if (geteuid() == 0) ways.insert(ways.begin(), "-n");
  for (const std::string& way : ways) {
    const std::string probe = "unshare " + way + " sh -c '" + kRoute + "' 2>/dev/null";
    if (std::system(probe.c_str()) != 0) continue;  // NOLINT(cert-env33-c,concurrency-mt-unsafe)

    std::vector<std::string> words = {
        "unshare", way, "sh", "-c", std::string(kRoute) + " && exec \"$@\"", "sh"};
    std::vector<std::string> own = own_arguments();
    if (own.empty()) break;
    std::string self(4096, '\0');
    const ssize_t n = readlink("/proc/self/exe", self.data(), self.size());
    if (n <= 0 || static_cast<std::size_t>(n) == self.size()) break;
    self.resize(static_cast<std::size_t>(n));
    own.front() = self;
    words.insert(words.end(), own.begin(), own.end());
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    (void)setenv(kInside, "1", 1);  // NOLINT(concurrency-mt-unsafe)
    execvp(argv.front(), argv.data());
    const int reason = errno;
    (void)unsetenv(kInside);  // NOLINT(concurrency-mt-unsafe)
    return Error{std::string("cannot restart in a network namespace: ") + std::strerror(reason)};
  }
  return Error{
      "no private bus: this system allows neither 'unshare -rn' nor 'unshare -n', or iproute2 is "
      "missing; use an existing bus by --lcm-url"};
}

}  // namespace rcs::cli
