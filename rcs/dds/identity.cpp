#include "rcs/dds/identity.h"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <time.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string_view>
#include <system_error>
#include <vector>

#include "rcs/node/time_text.h"

namespace rcs::dds {
namespace {

namespace fs = std::filesystem;
using fs::perms;

constexpr char kKey[] = "key.pem";
constexpr char kIdentity[] = "identity.pem";
constexpr char kPermissions[] = "permissions.p7s";
constexpr char kRevocations[] = "crl.pem";

struct Free {
  void operator()(BIO* file) const { BIO_free(file); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(X509_CRL* list) const { X509_CRL_free(list); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

// ---- who may change a file ------------------------------------------------------------------

Error mode_error(const fs::path& path, perms mode, std::string_view consequence,
                 std::string_view remedy) {
  return {fmt::format("{}: mode {:04o} allows others {}: {} {}", path.string(),
                      static_cast<unsigned>(mode & perms::mask), consequence, remedy,
                      path.string())};
}

/// Whoever changes an authority, the rules or the list of revoked certificates chooses who commands
/// the vehicle, and whoever reads the private key is the vehicle for all operators.
Outcome check_mode(const fs::path& path, perms mode) {
  if (path.filename() == kKey &&
      (mode & (perms::others_all | perms::group_write | perms::group_exec)) != perms::none) {
    return mode_error(path, mode, "to read or to change the private key", "chmod 600");
  }
  if ((mode & (perms::group_write | perms::others_write)) != perms::none) {
    return mode_error(path, mode, "to change who may command the vehicle", "chmod go-w");
  }
  return Done{};
}

Outcome check_file(const fs::path& path) {
  std::error_code failed;
  const fs::file_status status = fs::status(path, failed);
  if (status.type() != fs::file_type::regular) {
    return Error{fmt::format(
        "{}: missing or not readable ({}); the folder must be that of one identity made by `rcs "
        "keys`",
        path.string(), failed ? failed.message() : "not a regular file")};
  }
  return check_mode(path, status.permissions());
}

/// Whoever can write in the folder can replace its files.
Outcome check_folder(const fs::path& folder) {
  std::error_code failed;
  const fs::file_status status = fs::status(folder, failed);
  if (failed) return Error{fmt::format("{}: {}", folder.string(), failed.message())};
  return check_mode(folder, status.permissions());
}

/// A list that exists but cannot be examined is not the same as no list: an error.
Result<bool> has_revocations(const fs::path& path) {
  std::error_code failed;
  const fs::file_status link = fs::symlink_status(path, failed);
  if (link.type() == fs::file_type::not_found) return false;
  const Outcome checked = check_file(path);
  return checked ? Result<bool>(true) : checked.error();
}

// ---- ends of validity ------------------------------------------------------------------------

/// With the first cause that OpenSSL states.
Error unreadable(const fs::path& path, std::string_view what) {
  const auto code = ERR_peek_error();
  const char* const reason = ERR_reason_error_string(code);  // null of errors of the system
  std::string cause = reason != nullptr ? reason : "unknown cause";
  if (ERR_SYSTEM_ERROR(code)) cause = std::generic_category().message(ERR_GET_REASON(code));
  ERR_clear_error();
  return {fmt::format("{}: not readable as {}: {}", path.string(), what, cause)};
}

Result<Validity> ends_at(const fs::path& path, const ASN1_TIME* end) {
  tm utc{};
  if (end == nullptr || ASN1_TIME_to_tm(end, &utc) != 1) {
    return Error{fmt::format("{}: states no end of its validity", path.string())};
  }
  return Validity{path.string(), timegm(&utc) * std::int64_t{1'000'000}};
}

Result<Validity> certificate_validity(const fs::path& path) {
  const Owned<BIO> file(BIO_new_file(path.c_str(), "r"));
  const Owned<X509> certificate(file ? PEM_read_bio_X509(file.get(), nullptr, nullptr, nullptr)
                                     : nullptr);
  if (!certificate) return unreadable(path, "a certificate (PEM)");
  return ends_at(path, X509_get0_notAfter(certificate.get()));
}

struct Revocations {
  int count = 0;
  Validity validity;
};

Result<Revocations> read_revocations(const fs::path& path) {
  const Owned<BIO> file(BIO_new_file(path.c_str(), "r"));
  const Owned<X509_CRL> list(file ? PEM_read_bio_X509_CRL(file.get(), nullptr, nullptr, nullptr)
                                  : nullptr);
  if (!list) return unreadable(path, "a list of revoked certificates (PEM)");
  const Result<Validity> validity = ends_at(path, X509_CRL_get0_nextUpdate(list.get()));
  if (!validity) return validity.error();
  // An empty list has no entries at all, whose number is -1.
  return Revocations{std::max(0, sk_X509_REVOKED_num(X509_CRL_get_REVOKED(list.get()))), *validity};
}

/// ISO 8601; without an offset it is UTC, as for DDS.
std::optional<std::int64_t> utime_of(const std::string& text) {
  tm t{};
  const char* rest = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &t);
  if (rest == nullptr) return std::nullopt;
  if (*rest == '.') {
    rest += 1 + std::strspn(rest + 1, "0123456789");
  }
  tm offset{};
  if (*rest != '\0') rest = strptime(rest, "%z", &offset);
  if (rest == nullptr || *rest != '\0') return std::nullopt;
  return (std::int64_t{timegm(&t)} - offset.tm_gmtoff) * 1'000'000;
}

/// The text that is signed is clear text in the file. DDS checks the signature.
Result<Validity> permissions_validity(const fs::path& path) {
  std::ifstream in(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  constexpr std::string_view kBegin = "<not_after>";
  std::optional<std::int64_t> first;
  for (std::size_t at = text.find(kBegin); at != std::string::npos; at = text.find(kBegin, at)) {
    at += kBegin.size();
    const std::optional<std::int64_t> end = utime_of(text.substr(at, text.find('<', at) - at));
    if (!end) {
      first.reset();
      break;
    }
    first = std::min(first.value_or(*end), *end);
  }
  if (first) return Validity{path.string(), *first};
  return Error{fmt::format(
      "{}: states no end of its validity as <not_after>2027-11-26T19:30:00</not_after> in clear "
      "text, or is not readable",
      path.string())};
}

}  // namespace

Result<Identity> read_identity(const std::string& folder) {
  const fs::path in = folder;
  for (const char* const file :
       {"identity_ca.pem", kIdentity, kKey, "permissions_ca.pem", "governance.p7s", kPermissions}) {
    if (const Outcome checked = check_file(in / file); !checked) return checked.error();
  }
  const Result<bool> listed = has_revocations(in / kRevocations);
  if (!listed) return listed.error();
  if (const Outcome checked = check_folder(in); !checked) return checked.error();

  Identity identity;
  std::vector<Result<Validity>> ends;
  for (const char* const file : {kIdentity, "identity_ca.pem", "permissions_ca.pem"}) {
    ends.push_back(certificate_validity(in / file));
  }
  ends.push_back(permissions_validity(in / kPermissions));
  if (*listed) {
    const Result<Revocations> list = read_revocations(in / kRevocations);
    if (!list) return list.error();
    identity.revoked = list->count;
    ends.emplace_back(list->validity);
  }
  for (const Result<Validity>& end : ends) {
    if (!end) return end.error();
    const bool first =
        identity.validity.path.empty() || end->end_utime < identity.validity.end_utime;
    if (first) identity.validity = *end;
  }
  return identity;
}

std::string end_text(const Validity& validity) {
  return fmt::format("{} {} UTC", utc_date(validity.end_utime),
                     time_of_day(validity.end_utime).substr(0, 5));
}

std::string renewal_text(const Validity& validity, const std::string& name) {
  const fs::path file = fs::path(validity.path).filename();
  if (file == kIdentity || file == kPermissions) {
    return fmt::format("renew it with `rcs keys FOLDER --renew {}`", name);
  }
  return "make new keys for all with `rcs keys`: the authority itself ends";
}

}  // namespace rcs::dds
