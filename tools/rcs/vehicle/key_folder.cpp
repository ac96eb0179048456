#include "tools/rcs/vehicle/key_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <vector>

#include "modules/gateway/operator_commands.h"
#include "rcs/base/file_handle.h"
#include "tools/base/files.h"

namespace rcs::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kAuthorities[] = "ca";
constexpr char kDays[] = "3650";

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

// Valid as long as the certificate, whose dates are decisive.
std::string permissions(const std::string& name, KeyRole role) {
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
      "        <not_after>2100-01-01T00:00:00</not_after>\n"
      "      </validity>\n"
      "      <allow_rule>\n"
      "        <domains><id_range><min>0</min><max>230</max></id_range></domains>\n"
      "{}"
      "      </allow_rule>\n"
      "      <default>DENY</default>\n"
      "    </grant>\n"
      "  </permissions>\n"
      "</dds>\n",
      grant_name(name, role), name, rules);
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

/// Runs openssl without a shell. @return its output as an error if it fails
Outcome openssl(std::vector<std::string> args) {
  args.insert(args.begin(), "openssl");
  std::vector<char*> argv;
  argv.reserve(args.size() + 1);
  for (std::string& a : args) argv.push_back(a.data());
  argv.push_back(nullptr);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return Error{"cannot create a pipe to openssl"};
  const FileHandle from(ends[0]);
  FileHandle to(ends[1]);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, to.get(), STDERR_FILENO);
  pid_t pid = -1;
  const int failed = ::posix_spawnp(&pid, "openssl", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  (void)to.close();
  if (failed != 0) {
    return Error{
        fmt::format("cannot run openssl ({}); install the package openssl", std::strerror(failed))};
  }

  std::string said;
  std::array<char, 512> buffer{};
  for (ssize_t n = 0; (n = ::read(from.get(), buffer.data(), buffer.size())) > 0;) {
    said.append(buffer.data(), static_cast<std::size_t>(n));
  }
  int status = 0;
  if (::waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return Done{};
  }
  return Error{fmt::format("openssl {} failed: {}", args[1], said)};
}

Outcome make_key(const fs::path& key) {
  return openssl(
      {"genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", key.string()});
}

Outcome sign(const fs::path& authorities, const fs::path& text, const fs::path& signed_text) {
  return openssl({"smime", "-sign", "-text", "-in", text.string(), "-out", signed_text.string(),
                  "-signer", (authorities / "permissions_ca.pem").string(), "-inkey",
                  (authorities / "permissions_ca.key.pem").string()});
}

Outcome make_authority(const fs::path& folder, const std::string& name) {
  const fs::path key = folder / (name + "_ca.key.pem");
  if (Outcome made = make_key(key); !made) return made;
  return openssl({"req", "-x509", "-new", "-sha256", "-days", kDays, "-config",
                  (folder / "openssl.cnf").string(), "-extensions", "authority", "-subj",
                  fmt::format("/O=RCS/CN={} authority", name), "-key", key.string(), "-out",
                  (folder / (name + "_ca.pem")).string()});
}

/// A folder that is created completely or not at all.
template <class Fill>
Outcome make_whole(const fs::path& folder, const Fill& fill) {
  const fs::path partial = folder.string() + ".partial";  // no name of an identity has a dot
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
  if (fs::exists(fs::path(path) / kAuthorities)) return keys;
  if (!fs::is_empty(path, failed)) {
    return Error{path + ": not empty, and not a folder of keys: no authorities (ca/)"};
  }
  if (Outcome made = keys.make_authorities(); !made) return made.error();
  keys.authorities_made_ = true;
  return keys;
}

Result<bool> KeyFolder::add(const std::string& name, KeyRole role) const {
  if (!gateway::is_name(name) || name == kAuthorities) {
    return Error{fmt::format("{}: a name is 1 to 32 letters, digits, '_' or '-', and not \"{}\"",
                             name, kAuthorities)};
  }
  const fs::path folder = fs::path(path_) / name;
  if (fs::exists(folder)) {
    const Result<std::string> there = tools::read_text((folder / "permissions.xml").string());
    if (!there) return there.error();
    if (there->find(grant_name(name, role)) != std::string::npos) return false;
    return Error{
        fmt::format("{}: exists with another role than {}; keys are never changed: use another "
                    "name or remove the folder",
                    folder.string(), text(role))};
  }
  const PrivateFiles private_files;
  if (Outcome made = make_identity(folder.string(), name, role); !made) return made.error();
  return true;
}

Outcome KeyFolder::make_authorities() const {
  return make_whole(fs::path(path_) / kAuthorities, [](const fs::path& folder) -> Outcome {
    if (Outcome w = tools::write_text((folder / "openssl.cnf").string(), kOpensslConfig); !w)
      return w;
    if (Outcome made = make_authority(folder, "identity"); !made) return made;
    if (Outcome made = make_authority(folder, "permissions"); !made) return made;
    if (Outcome w = tools::write_text((folder / "governance.xml").string(), kGovernance); !w)
      return w;
    return sign(folder, folder / "governance.xml", folder / "governance.p7s");
  });
}

Outcome KeyFolder::make_identity(const std::string& folder, const std::string& name,
                                 KeyRole role) const {
  const fs::path authorities = fs::path(path_) / kAuthorities;
  return make_whole(folder, [&](const fs::path& made_in) -> Outcome {
    const fs::path key = made_in / "key.pem";
    const fs::path rights = made_in / "permissions.xml";
    if (Outcome made = make_key(key); !made) return made;
    Outcome certified = openssl({"req",         "-x509",
                                 "-new",        "-sha256",
                                 "-days",       kDays,
                                 "-config",     (authorities / "openssl.cnf").string(),
                                 "-extensions", "identity",
                                 "-subj",       "/O=RCS/CN=" + name,
                                 "-key",        key.string(),
                                 "-CA",         (authorities / "identity_ca.pem").string(),
                                 "-CAkey",      (authorities / "identity_ca.key.pem").string(),
                                 "-out",        (made_in / "identity.pem").string()});
    if (!certified) return certified;
    if (Outcome w = tools::write_text(rights.string(), permissions(name, role)); !w) return w;
    if (Outcome s = sign(authorities, rights, made_in / "permissions.p7s"); !s) return s;
    for (const char* const file : {"identity_ca.pem", "permissions_ca.pem", "governance.p7s"}) {
      std::error_code failed;
      fs::copy_file(authorities / file, made_in / file, failed);
      if (failed) return Error{fmt::format("{}: {}", (made_in / file).string(), failed.message())};
    }
    return Done{};
  });
}

}  // namespace rcs::cli
