#pragma once
// A folder of keys for DDS Security: two authorities, and a folder for each identity with all files
// that the identity needs, but not the private keys of the authorities. Uses the openssl program.
//
//   ca/      identity_ca and permissions_ca (certificates and private keys), governance
//            crl.pem: the list of revoked certificates, empty at first
//   NAME/    identity.pem key.pem permissions.p7s identity_ca.pem permissions_ca.pem governance.p7s
//            crl.pem

#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::cli {

/// Permissions of an identity. Every identity writes only to the partition of its own name.
enum class KeyRole {
  kVehicle,   ///< writes VehicleState and NodeStatus, reads commands
  kOperator,  ///< reads VehicleState and NodeStatus, writes commands
  kObserver,  ///< reads VehicleState and NodeStatus
};

[[nodiscard]] std::string_view text(KeyRole role);

struct KeyIdentity {
  std::string name;
  std::string role;
  std::string valid_until;  ///< UTC, "2027-11-26 19:30:00"; of certificate and permissions
  double days_left = 0.0;   ///< negative: expired
  bool revoked = false;
};

/// Existing keys are never overwritten. Files get mode 0600, folders 0700.
class KeyFolder {
 public:
  /// Creates the authorities if the folder has none.
  static Result<KeyFolder> open(const std::string& path);
  /// An error if the folder has no authorities.
  static Result<KeyFolder> open_existing(const std::string& path);

  static constexpr int kDays = 365;

  /// @param days  validity from now
  /// @return true: created; false: existed with this role
  Result<bool> add(const std::string& name, KeyRole role, int days = kDays) const;
  /// A new certificate and new permissions for the same key and role, and the newest list of
  /// revoked certificates. The old ones stay valid until their end.
  [[nodiscard]] Outcome renew(const std::string& name, int days) const;
  /// Adds the certificate to the list of revoked ones, in all folders of identities. A participant
  /// rejects it once it has the list and its program has started again.
  [[nodiscard]] Outcome revoke(const std::string& name) const;
  /// All identities, by name.
  [[nodiscard]] Result<std::vector<KeyIdentity>> identities() const;

  [[nodiscard]] bool authorities_made() const { return authorities_made_; }

 private:
  explicit KeyFolder(std::string path) : path_(std::move(path)) {}
  [[nodiscard]] Outcome make_authorities() const;
  [[nodiscard]] Outcome make_identity(const std::string& folder, const std::string& name,
                                      KeyRole role, int days) const;

  std::string path_;
  bool authorities_made_ = false;
};

}  // namespace rcs::cli
