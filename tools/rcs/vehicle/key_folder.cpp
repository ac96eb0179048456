#include "tools/rcs/vehicle/key_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <optional>

#include "modules/gateway/operator_commands.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/base/files.h"
#include "tools/rcs/vehicle/openssl.h"

namespace rcs::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kAuthorities[] = "ca";
constexpr int kAuthorityDays = 3650;
constexpr char kRevocations[] = "crl.pem";
constexpr char kRevokedIndex[] = "index.txt";
constexpr char kIssued[] = "issued";  // certificates of each identity, by serial number

// Complete, so that the openssl.cnf of the machine is not used. An identity cannot sign
// certificates for others.
constexpr char kOpensslConfig[] = R"([req]
distinguished_name = subject
prompt = no
[subject]
O = RCS
[authority]
basicConstraints = critical, CA:true, pathlen:0
keyUsage = critical, keyCertSign, cRLSign, digitalSignature
subjectKeyIdentifier = hash
[identity]
basicConstraints = critical, CA:false
keyUsage = critical, digitalSignature
)";
// The certificates that were revoked are in index.txt.
constexpr char kRevocationConfig[] = R"([ca]
default_ca = identities
[identities]
database = {0}/index.txt
certificate = {0}/identity_ca.pem
private_key = {0}/identity_ca.key.pem
default_md = sha256
default_crl_days = 3650
)";

// Unauthenticated participants are excluded. Whole messages are encrypted, and the part of each
// writer once more by its own key, so that a reader cannot write in the name of another.
constexpr char kGovernance[] = R"(<?xml version="1.0" encoding="utf-8"?>
<dds>
  <domain_access_rules>
    <domain_rule>
      <domains><id_range><min>0</min><max>230</max></id_range></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";

constexpr char kStateTopics[] = "<topic>VehicleState</topic><topic>NodeStatus</topic>";
constexpr char kCommandTopics[] = "<topic>WaypointCommand</topic><topic>EmergencyStop</topic>";

std::string rule(std::string_view what, std::string_view topics, std::string_view partition) {
  return fmt::format(
      "        <{0}>\n"
      "          <topics>{1}</topics>\n"
      "          <partitions><partition>{2}</partition></partitions>\n"
      "        </{0}>\n",
      what, topics, partition);
}

std::string grant_name(const std::string& name, KeyRole role) {
  return fmt::format("<grant name=\"{} {}\">", text(role), name);
}

/// @param until  ISO 8601, of the certificate
std::string permissions(const std::string& name, KeyRole role, std::string_view until) {
  std::string rules;
  if (role == KeyRole::kVehicle) rules += rule("publish", kStateTopics, name);
  if (role == KeyRole::kOperator) rules += rule("publish", kCommandTopics, name);
  rules += rule("subscribe", role == KeyRole::kVehicle ? kCommandTopics : kStateTopics, "*");
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<dds>\n"
      "  <permissions>\n"
      "    {}\n"
      "      <subject_name>CN={},O=RCS</subject_name>\n"
      "      <validity>\n"
      "        <not_before>2000-01-01T00:00:00</not_before>\n"
      "        <not_after>{}</not_after>\n"
      "      </validity>\n"
      "      <allow_rule>\n"
      "        <domains><id_range><min>0</min><max>230</max></id_range></domains>\n"
      "{}"
      "      </allow_rule>\n"
      "      <default>DENY</default>\n"
      "    </grant>\n"
      "  </permissions>\n"
      "</dds>\n",
      grant_name(name, role), name, until, rules);
}

/// During its lifetime files are created with access for the owner only, also those of openssl.
class PrivateFiles {
 public:
  PrivateFiles() : before_(::umask(0077)) {}
  PrivateFiles(const PrivateFiles&) = delete;
  PrivateFiles& operator=(const PrivateFiles&) = delete;
  ~PrivateFiles() { ::umask(before_); }

 private:
  mode_t before_;
};

Outcome make_key(const fs::path& key) {
  return run_openssl(
      {"genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", key.string()});
}

Outcome sign(const fs::path& authorities, const fs::path& text, const fs::path& signed_text) {
  return run_openssl({"smime", "-sign", "-text", "-in", text.string(), "-out", signed_text.string(),
                      "-signer", (authorities / "permissions_ca.pem").string(), "-inkey",
                      (authorities / "permissions_ca.key.pem").string()});
}

Outcome make_authority(const fs::path& folder, const std::string& name) {
  const fs::path key = folder / (name + "_ca.key.pem");
  if (Outcome made = make_key(key); !made) return made;
  return run_openssl({"req", "-x509", "-new", "-sha256", "-days", std::to_string(kAuthorityDays),
                      "-config", (folder / "openssl.cnf").string(), "-extensions", "authority",
                      "-subj", fmt::format("/O=RCS/CN={} authority", name), "-key", key.string(),
                      "-out", (folder / (name + "_ca.pem")).string()});
}

/// The end of a certificate's validity: "2027-11-26 19:30:00", UTC.
Result<std::string> end_of(const fs::path& certificate) {
  const Result<std::string> text = openssl_output(
      {"x509", "-enddate", "-noout", "-dateopt", "iso_8601", "-in", certificate.string()});
  if (!text) return text.error();
  const std::size_t equals = text->find('=');
  if (equals == std::string::npos || text->size() < equals + 20) {
    return Error{certificate.string() + ": openssl states no end of its validity"};
  }
  return text->substr(equals + 1, 19);
}

double days_until(const std::string& utc) {
  std::tm t{};
  if (strptime(utc.c_str(), "%Y-%m-%d %H:%M:%S", &t) == nullptr) return 0.0;
  return (static_cast<double>(timegm(&t)) - 1e-6 * static_cast<double>(wall_utime())) / 86400.0;
}

/// Errors have the path, unlike the exceptions of std::filesystem.
Result<bool> is_there(const fs::path& path) {
  std::error_code failed;
  const fs::file_status status = fs::status(path, failed);
  if (status.type() == fs::file_type::none) {
    return Error{fmt::format("{}: {}", path.string(), failed.message())};
  }
  return fs::exists(status);
}

Result<std::vector<fs::path>> entries_of(const fs::path& folder) {
  std::error_code failed;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, failed); !failed && at != fs::directory_iterator();
       at.increment(failed)) {
    entries.push_back(at->path());
  }
  if (failed) return Error{fmt::format("{}: {}", folder.string(), failed.message())};
  return entries;
}

/// The folders of the identities.
Result<std::vector<fs::path>> identities_in(const fs::path& folder) {
  Result<std::vector<fs::path>> entries = entries_of(folder);
  if (!entries) return entries;
  std::vector<fs::path> found;
  for (const fs::path& entry : *entries) {
    const Result<bool> identity = is_there(entry / "identity.pem");
    if (!identity) return identity.error();
    if (*identity) found.push_back(entry);
  }
  return found;
}

/// The name of a folder while it is filled; no name of an identity has a dot.
fs::path partial_of(const fs::path& folder) { return folder.string() + ".partial"; }

/// A folder that is created completely or not at all.
template <class Fill>
Outcome make_whole(const fs::path& folder, const Fill& fill) {
  const fs::path partial = partial_of(folder);
  std::error_code failed;
  fs::remove_all(partial, failed);  // of a run that was interrupted
  if (::mkdir(partial.c_str(), 0700) != 0) {
    return Error{fmt::format("{}: cannot create: {}", partial.string(), std::strerror(errno))};
  }
  if (Outcome filled = fill(partial); !filled) {
    fs::remove_all(partial, failed);
    return filled;
  }
  fs::rename(partial, folder, failed);
  if (failed) return Error{fmt::format("{}: {}", folder.string(), failed.message())};
  return Done{};
}

/// "serial=1F...": hexadecimal, as in index.txt.
Result<std::string> serial_of(const fs::path& certificate) {
  const Result<std::string> text =
      openssl_output({"x509", "-serial", "-noout", "-in", certificate.string()});
  if (!text) return text.error();
  const std::size_t begin = text->find('=') + 1;
  const std::size_t end = text->find_first_not_of("0123456789ABCDEF", begin);
  if (begin == 0 || end == begin) return Error{certificate.string() + ": no serial number"};
  return text->substr(begin, end == std::string::npos ? end : end - begin);
}

/// Keeps a copy of the certificate of an identity: a renewal replaces it, but it stays valid until
/// it is revoked.
/// @return the folder of the copies
Result<fs::path> keep(const fs::path& authorities, const fs::path& identity,
                      const std::string& name) {
  const Result<std::string> serial = serial_of(identity / "identity.pem");
  if (!serial) return serial.error();
  const fs::path folder = authorities / kIssued / name;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!failed) {
    fs::copy_file(identity / "identity.pem", folder / (*serial + ".pem"),
                  fs::copy_options::overwrite_existing, failed);
  }
  if (failed) return Error{fmt::format("{}: {}", folder.string(), failed.message())};
  return folder;
}

/// Signs a certificate for the identity's key, and permissions that last as long.
Outcome certify(const fs::path& authorities, const fs::path& folder, const std::string& name,
                KeyRole role, int days) {
  Outcome certified = run_openssl({"req",         "-x509",
                                   "-new",        "-sha256",
                                   "-days",       std::to_string(days),
                                   "-config",     (authorities / "openssl.cnf").string(),
                                   "-extensions", "identity",
                                   "-subj",       "/O=RCS/CN=" + name,
                                   "-key",        (folder / "key.pem").string(),
                                   "-CA",         (authorities / "identity_ca.pem").string(),
                                   "-CAkey",      (authorities / "identity_ca.key.pem").string(),
                                   "-out",        (folder / "identity.pem").string()});
  if (!certified) return certified;
  if (const Result<fs::path> kept = keep(authorities, folder, name); !kept) return kept.error();
  Result<std::string> until = end_of(folder / "identity.pem");
  if (!until) return until.error();
  until.value().replace(10, 1, "T");
  const fs::path rights = folder / "permissions.xml";
  // A renewal has read the former permissions, and no command overwrites what it has read.
  const fs::path renewed = folder / "permissions.new";
  if (Outcome w = tools::write_text(renewed.string(), permissions(name, role, *until)); !w) {
    return w;
  }
  std::error_code failed;
  fs::rename(renewed, rights, failed);
  if (failed) return Error{fmt::format("{}: {}", rights.string(), failed.message())};
  return sign(authorities, rights, folder / "permissions.p7s");
}

/// What `openssl ca` needs for the list of revoked certificates.
/// @return the path of its configuration
Result<fs::path> prepare_list(const fs::path& authorities) {
  const Result<bool> indexed = is_there(authorities / kRevokedIndex);
  if (!indexed) return indexed.error();
  if (!*indexed) {
    if (Outcome w = tools::write_text((authorities / kRevokedIndex).string(), ""); !w) {
      return w.error();
    }
  }
  std::error_code failed;
  const fs::path absolute = fs::absolute(authorities, failed);
  if (failed) return Error{fmt::format("{}: {}", authorities.string(), failed.message())};
  const fs::path config = authorities / "revocation.cnf";
  const std::string text = fmt::format(kRevocationConfig, absolute.string());
  if (Outcome w = tools::write_text(config.string(), text); !w) return w.error();
  return config;
}

/// Signs the list of the certificates that index.txt names as revoked; at first it is empty, so
/// that every participant can require a list.
Outcome make_list(const fs::path& authorities) {
  const Result<fs::path> config = prepare_list(authorities);
  if (!config) return config.error();
  return run_openssl({"ca", "-config", config->string(), "-gencrl", "-out",
                      (authorities / kRevocations).string()});
}

Outcome copy_list(const fs::path& authorities, const fs::path& folder) {
  std::error_code failed;
  fs::copy_file(authorities / kRevocations, folder / kRevocations,
                fs::copy_options::overwrite_existing, failed);
  if (failed) return Error{fmt::format("{}: {}", folder.string(), failed.message())};
  return Done{};
}

/// For authorities of a program that made no list before the first revocation.
Outcome make_missing_list(const fs::path& authorities) {
  const Result<bool> made = is_there(authorities / kRevocations);
  if (!made) return made.error();
  return *made ? Outcome(Done{}) : make_list(authorities);
}

/// @param index  text of index.txt: a certificate is revoked once only
Outcome revoke_certificate(const fs::path& config, const fs::path& certificate,
                           const std::string& index) {
  const Result<std::string> serial = serial_of(certificate);
  if (!serial) return serial.error();
  if (index.find("\t" + *serial + "\t") != std::string::npos) return Done{};
  return run_openssl({"ca", "-config", config.string(), "-revoke", certificate.string()});
}

/// The role that the permissions of an identity state.
std::optional<KeyRole> role_in(const std::string& permissions, const std::string& name) {
  for (const KeyRole role : {KeyRole::kVehicle, KeyRole::kOperator, KeyRole::kObserver}) {
    if (permissions.find(grant_name(name, role)) != std::string::npos) return role;
  }
  return std::nullopt;
}

}  // namespace

std::string_view text(KeyRole role) {
  constexpr std::string_view kTexts[] = {"vehicle", "operator", "observer"};
  return kTexts[static_cast<std::size_t>(role)];
}

Result<KeyFolder> KeyFolder::open(const std::string& path) {
  const PrivateFiles private_files;
  KeyFolder keys(path);
  std::error_code failed;
  fs::create_directories(path, failed);
  if (failed) return Error{fmt::format("{}: {}", path, failed.message())};
  const Result<bool> made_before = is_there(fs::path(path) / kAuthorities);
  if (!made_before) return made_before.error();
  if (*made_before) return keys;
  const Result<std::vector<fs::path>> entries = entries_of(path);
  if (!entries) return entries.error();
  // An interrupted run may have left an incomplete folder of authorities.
  const bool foreign = std::any_of(entries->begin(), entries->end(), [](const fs::path& entry) {
    return entry.filename() != partial_of(kAuthorities);
  });
  if (foreign) {
    return Error{path + ": not empty, and not a folder of keys: no authorities (ca/)"};
  }
  if (Outcome made = keys.make_authorities(); !made) return made.error();
  keys.authorities_made_ = true;
  return keys;
}

Result<KeyFolder> KeyFolder::open_existing(const std::string& path) {
  const Result<bool> made = is_there(fs::path(path) / kAuthorities);
  if (!made) return made.error();
  if (*made) return KeyFolder(path);
  return Error{path + ": no keys; create them with --vehicle, --operator or --observer"};
}

Result<bool> KeyFolder::add(const std::string& name, KeyRole role, int days) const {
  if (!gateway::is_name(name) || name == kAuthorities) {
    return Error{fmt::format("{}: a name is 1 to 32 letters, digits, '_' or '-', and not \"{}\"",
                             name, kAuthorities)};
  }
  const fs::path folder = fs::path(path_) / name;
  const Result<bool> known = is_there(folder);
  if (!known) return known.error();
  if (*known) {
    const Result<std::string> there = tools::read_text((folder / "permissions.xml").string());
    if (!there) return there.error();
    if (there->find(grant_name(name, role)) != std::string::npos) return false;
    return Error{
        fmt::format("{}: exists with another role than {}; keys are never changed: use another "
                    "name or remove the folder",
                    folder.string(), text(role))};
  }
  const PrivateFiles private_files;
  if (Outcome made = make_identity(folder.string(), name, role, days); !made) return made.error();
  return true;
}

Outcome KeyFolder::make_authorities() const {
  return make_whole(fs::path(path_) / kAuthorities, [](const fs::path& folder) -> Outcome {
    if (Outcome w = tools::write_text((folder / "openssl.cnf").string(), kOpensslConfig); !w) {
      return w;
    }
    if (Outcome made = make_authority(folder, "identity"); !made) return made;
    if (Outcome made = make_authority(folder, "permissions"); !made) return made;
    if (Outcome w = tools::write_text((folder / "governance.xml").string(), kGovernance); !w) {
      return w;
    }
    if (Outcome made = make_list(folder); !made) return made;
    return sign(folder, folder / "governance.xml", folder / "governance.p7s");
  });
}

Outcome KeyFolder::make_identity(const std::string& folder, const std::string& name, KeyRole role,
                                 int days) const {
  const fs::path authorities = fs::path(path_) / kAuthorities;
  return make_whole(folder, [&](const fs::path& made_in) -> Outcome {
    if (Outcome made = make_key(made_in / "key.pem"); !made) return made;
    if (Outcome made = certify(authorities, made_in, name, role, days); !made) return made;
    if (Outcome made = make_missing_list(authorities); !made) return made;
    for (const char* const file :
         {"identity_ca.pem", "permissions_ca.pem", "governance.p7s", kRevocations}) {
      std::error_code failed;
      fs::copy_file(authorities / file, made_in / file, failed);
      if (failed) return Error{fmt::format("{}: {}", (made_in / file).string(), failed.message())};
    }
    return Done{};
  });
}

Outcome KeyFolder::renew(const std::string& name, int days) const {
  const PrivateFiles private_files;
  const fs::path folder = fs::path(path_) / name;
  const Result<std::string> rights = tools::read_text((folder / "permissions.xml").string());
  if (!rights) return rights.error();
  const std::optional<KeyRole> role = role_in(*rights, name);
  if (!role) return Error{folder.string() + ": permissions.xml states no role of this name"};
  const fs::path authorities = fs::path(path_) / kAuthorities;
  // Of a program that did not keep it.
  const Result<fs::path> kept = keep(authorities, folder, name);
  if (!kept) return kept.error();
  if (Outcome made = certify(authorities, folder, name, *role, days); !made) return made;
  if (Outcome made = make_missing_list(authorities); !made) return made;
  return copy_list(authorities, folder);
}

Outcome KeyFolder::revoke(const std::string& name) const {
  const Result<bool> identity = is_there(fs::path(path_) / name / "identity.pem");
  if (!identity) return identity.error();
  if (!*identity) {
    std::string all;
    if (const Result<std::vector<KeyIdentity>> known = identities(); known) {
      for (const KeyIdentity& k : *known) all += (all.empty() ? "" : ", ") + k.name;
    }
    return Error{fmt::format("no identity {} in {}; there are: {}", name, path_, all)};
  }
  const PrivateFiles private_files;
  const fs::path authorities = fs::path(path_) / kAuthorities;
  const Result<fs::path> config = prepare_list(authorities);
  if (!config) return config.error();
  const Result<fs::path> issued = keep(authorities, fs::path(path_) / name, name);
  if (!issued) return issued.error();
  const Result<std::string> before = tools::read_text((authorities / kRevokedIndex).string());
  if (!before) return before.error();
  const Result<std::vector<fs::path>> certificates = entries_of(*issued);
  if (!certificates) return certificates.error();
  for (const fs::path& certificate : *certificates) {
    if (Outcome revoked = revoke_certificate(*config, certificate, *before); !revoked) {
      return revoked;
    }
  }
  if (Outcome made = make_list(authorities); !made) return made;
  const Result<std::vector<fs::path>> folders = identities_in(path_);
  if (!folders) return folders.error();
  for (const fs::path& folder : *folders) {
    if (Outcome copied = copy_list(authorities, folder); !copied) return copied;
  }
  return Done{};
}

Result<std::vector<KeyIdentity>> KeyFolder::identities() const {
  std::vector<KeyIdentity> all;
  const fs::path authorities = fs::path(path_) / kAuthorities;
  std::string revoked;
  const Result<bool> any_revoked = is_there(authorities / kRevokedIndex);
  if (!any_revoked) return any_revoked.error();
  if (*any_revoked) {
    const Result<std::string> index = tools::read_text((authorities / kRevokedIndex).string());
    if (!index) return index.error();
    revoked = *index;
  }
  const Result<std::vector<fs::path>> folders = identities_in(path_);
  if (!folders) return folders.error();
  for (const fs::path& folder : *folders) {
    KeyIdentity one;
    one.name = folder.filename().string();
    const Result<std::string> rights = tools::read_text((folder / "permissions.xml").string());
    if (!rights) return rights.error();
    const std::optional<KeyRole> role = role_in(*rights, one.name);
    one.role = role ? std::string(text(*role)) : "unknown";
    const Result<std::string> until = end_of(folder / "identity.pem");
    if (!until) return until.error();
    one.valid_until = *until;
    one.days_left = days_until(*until);
    const Result<std::string> serial = serial_of(folder / "identity.pem");
    if (!serial) return serial.error();
    one.revoked = revoked.find("\t" + *serial + "\t") != std::string::npos;
    all.push_back(one);
  }
  std::sort(all.begin(), all.end(),
            [](const KeyIdentity& a, const KeyIdentity& b) { return a.name < b.name; });
  return all;
}

}  // namespace rcs::cli
