#include "tools/rcs/vehicle/key_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "tests/support/fresh_folder.h"
#include "tools/base/files.h"

namespace rcs::gateway {
namespace {

namespace fs = std::filesystem;

/// Every regular file below a folder with its content.
std::string contents(const fs::path& folder) {
  std::string all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) all += *tools::read_text(entry.path().string());
  }
  return all;
}

TEST(KeyFolder, CreatesAuthoritiesAndIdentitiesReadableByTheirOwnerOnly) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok()) << keys.error().message;
  EXPECT_TRUE(keys->authorities_made());
  const Result<bool> made = keys->add("alice", cli::KeyRole::kOperator);
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_TRUE(*made);
  for (const char* const file : {"identity.pem", "key.pem", "permissions.p7s", "identity_ca.pem",
                                 "permissions_ca.pem", "governance.p7s", "crl.pem"}) {
    EXPECT_TRUE(fs::exists(folder / "alice" / file)) << file;
  }
  EXPECT_EQ(contents(folder / "alice")
                .find(*tools::read_text((folder / "ca/identity_ca.key.pem").string())),
            std::string::npos)
      << "the private key of an authority is not copied";
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    struct stat s {};
    ASSERT_EQ(stat(entry.path().c_str(), &s), 0);
    EXPECT_EQ(s.st_mode & 0777U, entry.is_directory() ? 0700U : 0600U) << entry.path();
  }
}

TEST(KeyFolder, ExistingFilesAreKept) {
  const fs::path folder = test::fresh_folder();
  ASSERT_TRUE(cli::KeyFolder::open(folder.string())->add("demo3", cli::KeyRole::kVehicle).ok());
  const std::string before = contents(folder);

  const Result<cli::KeyFolder> again = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->authorities_made());
  const Result<bool> kept = again->add("demo3", cli::KeyRole::kVehicle);
  ASSERT_TRUE(kept.ok());
  EXPECT_FALSE(*kept);
  EXPECT_FALSE(again->add("demo3", cli::KeyRole::kObserver).ok()) << "another role";
  EXPECT_EQ(contents(folder), before);
  EXPECT_TRUE(*again->add("alice", cli::KeyRole::kOperator)) << "further identities are added";
}

TEST(KeyFolder, IdentitiesAreRenewedAndRevoked) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok());
  ASSERT_TRUE(keys->add("demo3", cli::KeyRole::kVehicle, 20).ok());
  ASSERT_TRUE(keys->add("alice", cli::KeyRole::kOperator).ok());
  const std::string key = *tools::read_text((folder / "demo3/key.pem").string());
  Result<std::vector<cli::KeyIdentity>> all = keys->identities();
  ASSERT_TRUE(all.ok()) << all.error().message;
  ASSERT_EQ(all->size(), 2U);
  EXPECT_EQ(all->at(1).role, "vehicle");
  EXPECT_NEAR(all->at(1).days_left, 20.0, 0.1);
  EXPECT_NEAR(all->at(0).days_left, 365.0, 0.1);
  EXPECT_NE(tools::read_text((folder / "demo3/permissions.xml").string())
                ->find(all->at(1).valid_until.substr(0, 10)),
            std::string::npos)
      << "permissions last as long as the certificate";

  ASSERT_TRUE(keys->renew("demo3", 100).ok());
  EXPECT_EQ(*tools::read_text((folder / "demo3/key.pem").string()), key);
  const Outcome revoked = keys->revoke("alice");
  ASSERT_TRUE(revoked.ok()) << revoked.error().message;
  all = keys->identities();
  ASSERT_TRUE(all.ok());
  EXPECT_TRUE(all->at(0).revoked);
  EXPECT_FALSE(all->at(1).revoked);
  EXPECT_NEAR(all->at(1).days_left, 100.0, 0.1);
  EXPECT_TRUE(fs::exists(folder / "demo3/crl.pem"));
  ASSERT_TRUE(keys->add("bob", cli::KeyRole::kOperator).ok());
  EXPECT_TRUE(fs::exists(folder / "bob/crl.pem")) << "later identities know the list, too";
  EXPECT_FALSE(keys->renew("nobody", 100).ok());
  EXPECT_FALSE(keys->revoke("nobody").ok());
}

TEST(KeyFolder, ARevocationAlsoConcernsTheFormerCertificatesOfAnIdentity) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok());
  ASSERT_TRUE(keys->add("alice", cli::KeyRole::kOperator).ok());
  ASSERT_TRUE(keys->add("alice-2", cli::KeyRole::kOperator).ok());
  ASSERT_TRUE(keys->renew("alice", 100).ok());
  ASSERT_TRUE(keys->renew("alice", 200).ok());
  const auto revoked = [&] {
    const std::string index = *tools::read_text((folder / "ca/index.txt").string());
    return std::count(index.begin(), index.end(), '\n');
  };
  Outcome done = keys->revoke("alice");
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_EQ(revoked(), 3);
  done = keys->revoke("alice");
  EXPECT_TRUE(done.ok()) << "again: " << done.error().message;
  EXPECT_EQ(revoked(), 3);
  EXPECT_FALSE(keys->identities()->at(1).revoked) << "of another with a longer name";
}

TEST(KeyFolder, AuthoritiesWithoutARevocationListGetItWithTheNextIdentityOrRenewal) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok());
  ASSERT_TRUE(keys->add("demo3", cli::KeyRole::kVehicle).ok());
  for (const char* const file : {"ca/crl.pem", "ca/index.txt", "demo3/crl.pem"}) {
    ASSERT_TRUE(fs::remove(folder / file)) << file;
  }
  ASSERT_TRUE(keys->add("alice", cli::KeyRole::kOperator).ok());
  EXPECT_TRUE(fs::exists(folder / "alice/crl.pem"));
  const Outcome renewed = keys->renew("demo3", 100);
  ASSERT_TRUE(renewed.ok()) << renewed.error().message;
  EXPECT_TRUE(fs::exists(folder / "demo3/crl.pem"));
}

TEST(KeyFolder, AnInvalidNameOrAForeignFolderIsRejected) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok());
  for (const char* const bad : {"", "ca", "../alice", "a/b", "a b", "*", "<x>"}) {
    EXPECT_FALSE(keys->add(bad, cli::KeyRole::kOperator).ok()) << bad;
  }
  fs::create_directories(folder / "full/of_something");
  EXPECT_FALSE(cli::KeyFolder::open((folder / "full").string()).ok());
}

TEST(KeyFolder, AnInterruptedRunDoesNotPreventTheNext) {
  const fs::path folder = test::fresh_folder();
  fs::create_directories(folder / "ca.partial/rest");
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok()) << keys.error().message;
  EXPECT_TRUE(keys->authorities_made());
  EXPECT_FALSE(fs::exists(folder / "ca.partial"));
}

TEST(KeyFolder, OnlyANewIdentityCreatesAuthorities) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> none = cli::KeyFolder::open_existing((folder / "keys").string());
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("create them with --vehicle, --operator or --observer"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "keys"));
  ASSERT_TRUE(cli::KeyFolder::open((folder / "keys").string()).ok());
  EXPECT_TRUE(cli::KeyFolder::open_existing((folder / "keys").string()).ok());
}

TEST(KeyFolder, ErrorsOfFilesHaveThePath) {
  const fs::path folder = test::fresh_folder();
  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(folder.string());
  ASSERT_TRUE(keys.ok());
  fs::create_symlink("itself", folder / "itself");  // its status is an error, for root, too
  const Result<std::vector<cli::KeyIdentity>> all = keys->identities();
  ASSERT_FALSE(all.ok());
  EXPECT_EQ(all.error().message.rfind((folder / "itself").string(), 0), 0U) << all.error().message;
  const std::string loop = (folder / "itself").string();
  EXPECT_FALSE(cli::KeyFolder::open(loop).ok());
  EXPECT_FALSE(cli::KeyFolder::open_existing(loop).ok());
  EXPECT_FALSE(keys->revoke("itself").ok());
  EXPECT_FALSE(keys->add("itself", cli::KeyRole::kOperator).ok());
}

}  // namespace
}  // namespace rcs::gateway
