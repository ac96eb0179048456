#include "tools/rcs/vehicle/service_manager.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>

#include "rcs/base/file_handle.h"
#include "tests/support/fresh_folder.h"
#include "tools/rcs/vehicle/run_lock.h"

namespace rcs::cli {
namespace {

void set(const char* variable, const std::string& value) {
  (void)setenv(variable, value.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

TEST(ServiceManager, ReceivesTheStateAndNeverBlocksTheSender) {
  const std::string path = (test::fresh_folder() / "notify").string();
  const FileHandle socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  ASSERT_EQ(bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  set("NOTIFY_SOCKET", path);
  notify_service_manager("WATCHDOG=1");
  std::array<char, 64> text{};
  const ssize_t n = recv(socket.get(), text.data(), text.size(), 0);
  EXPECT_EQ(std::string(text.data(), static_cast<std::size_t>(std::max<ssize_t>(0, n))),
            "WATCHDOG=1");
  for (int k = 0; k < 10'000; ++k) notify_service_manager("WATCHDOG=1");  // nobody reads
  for (const char* wrong : {"", "/nowhere/at/all", "@"}) {
    set("NOTIFY_SOCKET", wrong);
    notify_service_manager("WATCHDOG=1");
  }
}

TEST(RunLock, IsHeldByOneUntilItEnds) {
  const std::string bus = "udpm://239.255.76.99:7699";
  {
    const Result<RunLock> first = RunLock::take(bus + "?ttl=0");
    ASSERT_TRUE(first.ok()) << first.error().message;
    const Result<RunLock> second = RunLock::take(bus + "?ttl=1");
    ASSERT_FALSE(second.ok());
    EXPECT_NE(second.error().message.find("another `rcs up` runs on " + bus), std::string::npos);
    EXPECT_TRUE(RunLock::take("udpm://239.255.76.99:7700").ok());
  }
  EXPECT_TRUE(RunLock::take(bus).ok());
}

}  // namespace
}  // namespace rcs::cli
