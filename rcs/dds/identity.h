#pragma once
// The folder of an identity for DDS Security (made by `rcs keys`), as a participant reads it at its
// start: whether others can change it, what is revoked, and when its validity ends. Without DDS.

#include <cstdint>
#include <optional>
#include <string>

#include "rcs/base/result.h"

namespace rcs::dds {

struct Validity {
  std::string path;            ///< of the file
  std::int64_t end_utime = 0;  ///< UTC in microseconds since 1970
};

struct Identity {
  std::optional<int> revoked;  ///< number of certificates in crl.pem; empty: there is no crl.pem
  /// Of the file that ends first: identity.pem, permissions.p7s, the certificate of an authority,
  /// or crl.pem. From then on DDS accepts neither this participant nor, if it is an authority or
  /// crl.pem, any other.
  Validity validity;
};

/// Errors name the file and the remedy: a file is missing or unreadable, the group or others can
/// change it or its folder, others can read the private key, or an end of validity is not stated.
/// Credentials of systemd, which the group of the service can read, are accepted.
[[nodiscard]] Result<Identity> read_identity(const std::string& folder);

/// "2027-11-26 19:30 UTC"
[[nodiscard]] std::string end_text(const Validity& validity);

/// What renews the file: "renew it with ...".
/// @param name  of the identity
[[nodiscard]] std::string renewal_text(const Validity& validity, const std::string& name);

}  // namespace rcs::dds
