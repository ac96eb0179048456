#include "rcs/dds/identity.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "rcs/node/timeline/live_timeline.h"
#include "tests/support/fresh_folder.h"
#include "tools/base/files.h"
#include "tools/rcs/vehicle/key_folder.h"

namespace rcs::gateway {
namespace {

namespace fs = std::filesystem;
using dds::Identity;
using dds::read_identity;

constexpr const char* kFiles[] = {"identity_ca.pem", "identity.pem",    "permissions_ca.pem",
                                  "governance.p7s",  "permissions.p7s", "crl.pem"};

class IdentityFolder : public testing::Test {
 protected:
  void SetUp() override {
    const Result<cli::KeyFolder> keys = cli::KeyFolder::open(keys_.string());
    ASSERT_TRUE(keys.ok()) << keys.error().message;
    ASSERT_TRUE(keys->add("demo3", cli::KeyRole::kVehicle, 20).ok());
  }
  [[nodiscard]] Result<Identity> read() const { return read_identity(folder_.string()); }
  /// Empty: it was accepted.
  [[nodiscard]] std::string refusal() const {
    const Result<Identity> identity = read();
    return identity ? "" : identity.error().message;
  }
  void set_permissions_end(const std::string& text) const {
    std::string all = *tools::read_text((folder_ / "permissions.p7s").string());
    const std::size_t begin = all.find("<not_after>") + 11;
    all.replace(begin, all.find("</not_after>") - begin, text);
    std::ofstream(folder_ / "permissions.p7s") << all;
  }

  fs::path keys_ = test::fresh_folder() / "keys";
  fs::path folder_ = keys_ / "demo3";
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(IdentityFolder, TheFirstEndOfValidityAndTheNumberOfRevokedCertificatesAreRead) {
  const Result<Identity> fresh = read();
  ASSERT_TRUE(fresh.ok()) << fresh.error().message;
  EXPECT_EQ(fresh->revoked, 0);
  EXPECT_EQ(fresh->validity.path, (folder_ / "identity.pem").string());
  const std::int64_t left = fresh->validity.end_utime - wall_utime();
  EXPECT_NEAR(static_cast<double>(left) / 86'400e6, 20.0, 0.1);

  const Result<cli::KeyFolder> keys = cli::KeyFolder::open(keys_.string());
  ASSERT_TRUE(keys->add("alice", cli::KeyRole::kOperator).ok());
  ASSERT_TRUE(keys->revoke("alice").ok());
  EXPECT_EQ(read()->revoked, 1);
  fs::remove(folder_ / "crl.pem");
  ASSERT_TRUE(read().ok());
  EXPECT_FALSE(read()->revoked.has_value()) << "no list is not an empty list";
}

TEST_F(IdentityFolder, PermissionsThatEndBeforeTheCertificateAreTheEnd) {
  constexpr std::int64_t kNoon = 1'500'033'600'000'000;  // 2017-07-14 12:00:00 UTC
  for (const char* const noon : {"2017-07-14T12:00:00", "2017-07-14T12:00:00Z",
                                 "2017-07-14T14:00:00+02:00", "2017-07-14T12:00:00.250Z"}) {
    set_permissions_end(noon);
    const Result<Identity> identity = read();
    ASSERT_TRUE(identity.ok()) << identity.error().message;
    EXPECT_EQ(identity->validity.path, (folder_ / "permissions.p7s").string());
    EXPECT_EQ(identity->validity.end_utime, kNoon) << noon;
  }
  const dds::Validity validity = read()->validity;
  EXPECT_EQ(dds::end_text(validity), "2017-07-14 12:00 UTC");
  EXPECT_TRUE(has(dds::renewal_text(validity, "demo3"), "--renew demo3"));
  EXPECT_FALSE(has(dds::renewal_text({"keys/demo3/identity_ca.pem", 0}, "demo3"), "--renew"));
  for (const char* const bad : {"", "soon", "2017-07-14", "2017-07-14T12:00:00 or later"}) {
    set_permissions_end(bad);
    EXPECT_TRUE(has(refusal(), "permissions.p7s: states no end of its validity")) << bad;
  }
}

TEST_F(IdentityFolder, WhatTheGroupOrOthersCanChangeIsRefusedWithTheRemedy) {
  for (const char* const file : kFiles) {
    for (const unsigned mode : {0620U, 0602U, 0666U}) {
      fs::permissions(folder_ / file, fs::perms(mode));
      const std::string path = (folder_ / file).string();
      EXPECT_TRUE(has(refusal(), fmt::format("{}: mode {:04o} ", path, mode))) << refusal();
      EXPECT_TRUE(has(refusal(), "chmod go-w " + path)) << refusal();
    }
    fs::permissions(folder_ / file, fs::perms(0644));
    EXPECT_EQ(refusal(), "") << file << ": only the private key is secret";
  }
  for (const unsigned mode : {0770U, 0707U, 0777U}) {
    fs::permissions(folder_, fs::perms(mode));
    EXPECT_TRUE(has(refusal(), fmt::format("{}: mode {:04o} ", folder_.string(), mode)))
        << refusal();
    EXPECT_TRUE(has(refusal(), "chmod go-w " + folder_.string())) << refusal();
  }
  fs::permissions(folder_, fs::perms(0755));
  EXPECT_EQ(refusal(), "");
  for (const unsigned mode : {0644U, 0604U, 0620U, 0660U}) {
    fs::permissions(folder_ / "key.pem", fs::perms(mode));
    EXPECT_TRUE(has(refusal(), "chmod 600 " + (folder_ / "key.pem").string())) << refusal();
  }
}

// systemd makes them with modes 0400 and 0500; its access list for the user of the service is
// shown as access of the group.
TEST_F(IdentityFolder, CredentialsOfSystemdAreAccepted) {
  for (const unsigned group : {0U, 040U}) {
    for (const auto& entry : fs::directory_iterator(folder_)) {
      fs::permissions(entry.path(), fs::perms(0400U | group));
    }
    fs::permissions(folder_, fs::perms(0500U | group | (group >> 2U)));
    EXPECT_EQ(refusal(), "");
  }
  fs::permissions(folder_, fs::perms(0700));  // so that it can be removed
}

TEST_F(IdentityFolder, ARevocationListThatCannotBeReadIsNotAMissingOne) {
  const fs::path list = folder_ / "crl.pem";
  const std::string good = *tools::read_text(list.string());
  fs::remove(list);
  EXPECT_EQ(refusal(), "") << "no list";
  fs::create_symlink("nowhere", list);
  EXPECT_TRUE(has(refusal(), list.string() + ": missing or not readable")) << refusal();
  fs::remove(list);
  fs::create_symlink("crl.pem", list);  // its status is an error, for root, too
  EXPECT_TRUE(has(refusal(), list.string() + ": missing or not readable")) << refusal();
  fs::remove(list);
  fs::create_directory(list);
  EXPECT_TRUE(has(refusal(), list.string() + ": missing or not readable")) << refusal();
  fs::remove(list);
  for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2),
                                 *tools::read_text((folder_ / "identity.pem").string())}) {
    std::ofstream(list) << bad;
    fs::permissions(list, fs::perms(0600));
    EXPECT_TRUE(has(refusal(), list.string() + ": not readable as a list")) << refusal();
  }
}

TEST_F(IdentityFolder, AMissingOrDamagedFileIsNamed) {
  for (const char* const file : {"identity.pem", "identity_ca.pem", "permissions_ca.pem"}) {
    const std::string path = (folder_ / file).string();
    fs::rename(path, folder_ / "kept");
    EXPECT_TRUE(has(refusal(), path + ": missing or not readable (No such file")) << refusal();
    fs::copy_file(folder_ / "key.pem", path);  // PEM, and no certificate
    EXPECT_TRUE(has(refusal(), path + ": not readable as a certificate")) << refusal();
    fs::rename(folder_ / "kept", path);
  }
  EXPECT_EQ(refusal(), "");
}

}  // namespace
}  // namespace rcs::gateway
