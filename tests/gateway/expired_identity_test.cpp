// On a private bus (with_bus.sh): an operator over DDS, or a vehicle, whose certificate or
// permissions have expired, or expire meanwhile.

#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>

#include "rcs/node/timeline/live_timeline.h"
#include "tests/gateway/gateway_live.h"
#include "tools/base/files.h"
#include "tools/rcs/vehicle/key_folder.h"
#include "tools/rcs/vehicle/openssl.h"

namespace rcs::gateway {
namespace {

using test::kPatience;
using test::kWatch;

constexpr char kSecured[] = "[gateway.security]\ndirectory = \"keys/demo3\"\n";
constexpr std::int64_t kShort_s = 15;  // discovery takes a few seconds

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

class ExpiredIdentity : public test::GatewayLive {
 protected:
  void SetUp() override {
    const Result<cli::KeyFolder> made = cli::KeyFolder::open(keys_.string());
    ASSERT_TRUE(made.ok()) << made.error().message;
    ASSERT_TRUE(made->add("demo3", cli::KeyRole::kVehicle).ok());
    ASSERT_TRUE(made->add("alice", cli::KeyRole::kOperator).ok());
    ASSERT_TRUE(made->add("bob", cli::KeyRole::kOperator).ok());
    ASSERT_TRUE(made->add("late", cli::KeyRole::kOperator).ok());
    end_certificate("late");
  }
  /// Signs a certificate that ended yesterday.
  void end_certificate(const std::string& name) const {
    const std::string config = (keys_ / "ca/openssl.cnf").string();
    const std::string request = (keys_ / name / "request.pem").string();
    Outcome done = cli::run_openssl({"req", "-new", "-config", config, "-subj", "/O=RCS/CN=" + name,
                                     "-key", (keys_ / name / "key.pem").string(), "-out", request});
    ASSERT_TRUE(done.ok()) << done.error().message;
    done = cli::run_openssl({"x509", "-req", "-sha256", "-days", "-1", "-in", request, "-CA",
                             (keys_ / "ca/identity_ca.pem").string(), "-CAkey",
                             (keys_ / "ca/identity_ca.key.pem").string(), "-CAcreateserial",
                             "-extfile", config, "-extensions", "identity", "-out",
                             (keys_ / name / "identity.pem").string()});
    ASSERT_TRUE(done.ok()) << done.error().message;
  }
  /// Signs the permissions of an operator again, with another end.
  void end_permissions(const std::string& name, std::int64_t from_now_s) const {
    const std::time_t end = wall_utime() / 1'000'000 + from_now_s;
    std::tm utc{};
    ASSERT_NE(gmtime_r(&end, &utc), nullptr);
    std::array<char, 32> text{};
    ASSERT_GT(std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc), 0U);
    const std::string rights = (keys_ / name / "permissions.xml").string();
    std::string xml = *tools::read_text(rights);
    const std::size_t begin = xml.find("<not_after>") + 11;
    xml.replace(begin, xml.find("</not_after>") - begin, text.data());
    ASSERT_TRUE(tools::write_text(rights, xml).ok());
    const Outcome done = cli::run_openssl({"smime", "-sign", "-text", "-in", rights, "-out",
                                           (keys_ / name / "permissions.p7s").string(), "-signer",
                                           (keys_ / "ca/permissions_ca.pem").string(), "-inkey",
                                           (keys_ / "ca/permissions_ca.key.pem").string()});
    ASSERT_TRUE(done.ok()) << done.error().message;
  }
  std::unique_ptr<rcs::test::Program> of(const std::string& name, std::vector<std::string> words) {
    words.insert(words.begin(), {"-o", name});
    return client(std::move(words), keys_ / name);
  }

  std::filesystem::path keys_ = folder_ / "keys";
};

TEST_F(ExpiredIdentity, IsRejectedAndReported) {
  end_permissions("bob", -60);
  start_gateway(kSecured);
  const auto late = of("late", {"goto", "1", "6", "111", "0"});
  const auto late_stop = of("late", {"stop", "1", "6"});
  const auto bob = of("bob", {"goto", "1", "6", "112", "0"});
  for (rcs::test::Program* const p : {late.get(), late_stop.get(), bob.get()}) {
    ASSERT_TRUE(ends(p)) << p->output();
    EXPECT_EQ(p->status(), 3) << p->output();
    EXPECT_TRUE(p->has_said("refused: no participant")) << p->output();
  }
  EXPECT_TRUE(vehicle_.commands().empty());
  const auto alice = of("alice", {"goto", "1", "60", "10", "0"});
  EXPECT_TRUE(takes(command_t::KIND_GOTO)) << gateway_->output();
}

TEST_F(ExpiredIdentity, AnOperatorWhosePermissionsEndMeanwhileCommandsNoMore) {
  start_gateway(kSecured);
  end_permissions("bob", kShort_s);
  const Stamp end = vehicle_.now() + std::chrono::seconds(kShort_s);
  const auto bob = of("bob", {"goto", "1", "90", "10", "0"});
  ASSERT_TRUE(takes(command_t::KIND_GOTO)) << bob->output();
  const auto watch = of("bob", {"watch", "90"});
  ASSERT_TRUE(says(watch.get(), "state demo3")) << watch->output();
  vehicle_.run_for(end - vehicle_.now());
  EXPECT_TRUE(vehicle_.run_until([&] { return !vehicle_.commanded(); }, kPatience))
      << "commands of an operator whose permissions have ended are executed";
  std::printf("[  EXPIRED ] no command in force %.1f s after the end of the permissions\n",
              seconds(vehicle_.now() - end));
  const std::size_t taken = vehicle_.commands().size();
  const std::size_t states = count(watch->output(), "state demo3");
  vehicle_.run_for(kWatch);
  EXPECT_EQ(vehicle_.commands().size(), taken);
  EXPECT_EQ(count(watch->output(), "state demo3"), states)
      << "the vehicle's state is published to it";
  EXPECT_TRUE(says(bob.get(), "has expired")) << bob->output();
  const auto alice = of("alice", {"goto", "1", "60", "20", "0"});
  EXPECT_TRUE(vehicle_.run_until([&] { return vehicle_.commands().size() > taken; }, kPatience))
      << "another operator commands";
}

TEST_F(ExpiredIdentity, AVehicleReportsTheEndOfItsKeysBeforeAndAfter) {
  end_permissions("demo3", 25);  // a loaded computer needs a part of it to start the programs
  start_gateway(kSecured);
  EXPECT_TRUE(says(gateway_.get(), "dds.identity_expires")) << gateway_->output();
  EXPECT_TRUE(gateway_->has_said("permissions.p7s expires at")) << gateway_->output();
  const auto watch = of("alice", {"watch", "60"});
  EXPECT_TRUE(says(watch.get(), "reason \"keys expire at 20")) << watch->output();
  EXPECT_TRUE(says(gateway_.get(), "dds.identity_expired")) << gateway_->output();
  vehicle_.run_for(from_seconds(1.0));  // for samples that are on their way
  const std::size_t states = count(watch->output(), "state demo3");
  vehicle_.run_for(kWatch);
  EXPECT_EQ(count(watch->output(), "state demo3"), states) << "DDS has closed the connection";
  EXPECT_LT(gateway_->status(), 0) << gateway_->output();
}

TEST_F(ExpiredIdentity, AVehicleThatHasExpiredNamesTheFileAndTheRemedyAndDoesNotStart) {
  end_certificate("demo3");
  const std::string config = (folder_ / "vehicle.toml").string();
  ASSERT_TRUE(
      tools::write_text(config, std::string("[vehicle]\nname = \"demo3\"\n") + kSecured).ok());
  rcs::test::Program gateway({rcs::test::program_path("gateway"), config}, {});
  ASSERT_TRUE(ends(&gateway)) << gateway.output();
  EXPECT_EQ(gateway.status(), 3);
  EXPECT_TRUE(gateway.has_said("keys/demo3/identity.pem: expired at ")) << gateway.output();
  EXPECT_TRUE(gateway.has_said("`rcs keys FOLDER --renew demo3`")) << gateway.output();
}

}  // namespace
}  // namespace rcs::gateway
