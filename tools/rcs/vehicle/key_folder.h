#pragma once
// A folder of keys for DDS Security: two authorities, and a folder for each identity with all files
// that the identity needs, but not the private keys of the authorities. Uses the openssl program.
//
//   ca/      identity_ca and permissions_ca (certificates and private keys), governance
//   NAME/    identity.pem key.pem permissions.p7s identity_ca.pem permissions_ca.pem governance.p7s

#include <string>
#include <string_view>

#include "rcs/base/result.h"

namespace rcs::cli {

/// Permissions of an identity. Every identity writes only to the partition of its own name.
enum class KeyRole {
  kVehicle,   ///< writes VehicleState and NodeStatus, reads commands
  kOperator,  ///< reads VehicleState and NodeStatus, writes commands
  kObserver,  ///< reads VehicleState and NodeStatus
};

[[nodiscard]] std::string_view text(KeyRole role);

/// Existing keys are never overwritten. Files get mode 0600, folders 0700.
class KeyFolder {
 public:
  /// Creates the authorities if the folder has none.
  static Result<KeyFolder> open(const std::string& path);

  /// @return true: created; false: existed with this role
  Result<bool> add(const std::string& name, KeyRole role) const;

  [[nodiscard]] bool authorities_made() const { return authorities_made_; }

 private:
  explicit KeyFolder(std::string path) : path_(std::move(path)) {}
  [[nodiscard]] Outcome make_authorities() const;
  [[nodiscard]] Outcome make_identity(const std::string& folder, const std::string& name,
                                      KeyRole role) const;

  std::string path_;
  bool authorities_made_ = false;
};

}  // namespace rcs::cli
