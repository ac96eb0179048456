#pragma once
// A folder of keys for DDS Security: two authorities, and a folder for each identity that holds all
// that this identity needs and none of the authorities' private keys. Made by the openssl program.
//
//   ca/      identity_ca and permissions_ca (certificates and private keys), governance
//   NAME/    identity.pem key.pem permissions.p7s identity_ca.pem permissions_ca.pem governance.p7s

#include <string>
#include <string_view>

#include "rcs/base/result.h"

namespace rcs::cli {

/// What an identity may do. Everyone writes in the partition of their own name only.
enum class KeyRole {
  kVehicle,   ///< writes VehicleState and NodeStatus, reads commands
  kOperator,  ///< reads VehicleState and NodeStatus, writes commands
  kObserver,  ///< reads VehicleState and NodeStatus
};

[[nodiscard]] std::string_view text(KeyRole role);

/// What was there is never written over. Files get mode 0600, folders 0700.
class KeyFolder {
 public:
  /// Makes the authorities when there are none yet.
  static Result<KeyFolder> open(const std::string& path);

  /// @return true: made; false: was there, with this role
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
