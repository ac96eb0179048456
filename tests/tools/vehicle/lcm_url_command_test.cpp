// An unusable bus: advice of this system, and no line of liblcm.

#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class LcmUrlCommand : public RcsCommand {
 protected:
  /// @return messages() of a command on a computer without routes; empty: not possible here
  std::string without_routes(const std::string& arguments) {
    for (const char* space : {"unshare -rn ", "unshare -n "}) {
      if (std::system((std::string(space) + "true 2>/dev/null").c_str()) != 0) continue;
      const std::string command = space + variable("RCS_BIN_DIR") + "/rcs " + arguments + " >" +
                                  folder_ + "/out 2>" + folder_ + "/messages";
      status_ = std::system(command.c_str());  // NOLINT(cert-env33-c)
      return messages();
    }
    return "";
  }
  int status_ = 0;
};

TEST_F(LcmUrlCommand, AnInvalidAddressIsNamedByEveryCommandOnTheBus) {
  const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
  const std::vector<std::string> commands = {"top --once", "up " + config + "demo3.toml",
                                             "go --halt", "predict --to 1,2",
                                             "sim " + config + "sim/demo.toml"};
  for (const std::string& command : commands) {
    EXPECT_EQ(rcs(command + " --lcm-url 'udpm://10.0.0.1:7667?ttl=0'"), 3) << command;
    EXPECT_THAT(messages(), StartsWith("rcs " + command.substr(0, command.find(' ')) +
                                       ": invalid LCM address udpm://10.0.0.1:7667?ttl=0: "
                                       "10.0.0.1 is not a multicast address"));
  }
}

TEST_F(LcmUrlCommand, AMissingRouteIsReportedOnceWithItsRemedy) {
  for (const char* command : {"top --once", "go --halt"}) {
    const std::string said = without_routes(command);
    if (said.empty()) GTEST_SKIP() << "no network namespace on this system";
    EXPECT_NE(status_, 0);
    EXPECT_THAT(said, StartsWith("rcs "));
    EXPECT_THAT(said, HasSubstr("no route for UDP multicast to 239.255.76.67"));
    EXPECT_THAT(said, HasSubstr("ip route add 224.0.0.0/4 dev lo"));
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2) << said;
  }
}

}  // namespace
}  // namespace rcs::test
