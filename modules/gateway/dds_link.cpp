#include "modules/gateway/dds_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "modules/gateway/operator_commands.h"
#include "rcs/dds/log.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::gateway {
namespace {

using dds::make_qos;
using dds::Qos;

constexpr int kMaxProcesses = 20;
constexpr std::size_t kMaxSampleBytes = 64'000;  // samples of vehicle.idl are below 12 kB

struct Plugin {
  const char* service;  // as in dds.sec.<service>.library.path
  const char* file;
  const char* function;
};
constexpr Plugin kPlugins[] = {
    {"auth", "libdds_security_auth.so", "authentication"},
    {"access", "libdds_security_ac.so", "access_control"},
    {"crypto", "libdds_security_crypto.so", "crypto"},
};

struct KeyFile {
  const char* property;
  const char* file;
};
constexpr KeyFile kKeyFiles[] = {
    {"dds.sec.auth.identity_ca", "identity_ca.pem"},
    {"dds.sec.auth.identity_certificate", "identity.pem"},
    {"dds.sec.auth.private_key", "key.pem"},
    {"dds.sec.access.permissions_ca", "permissions_ca.pem"},
    {"dds.sec.access.governance", "governance.p7s"},
    {"dds.sec.access.permissions", "permissions.p7s"},
};

/// Its files were read by read_identity().
void set_security(dds_qos_t* qos, const std::filesystem::path& keys, bool has_revocations) {
  for (const Plugin& p : kPlugins) {
    const std::string library = fmt::format("dds.sec.{}.library.", p.service);
    dds_qset_prop(qos, (library + "path").c_str(),
                  fmt::format("{}/{}", RCS_DDS_PLUGINS, p.file).c_str());
    dds_qset_prop(qos, (library + "init").c_str(), fmt::format("init_{}", p.function).c_str());
    dds_qset_prop(qos, (library + "finalize").c_str(),
                  fmt::format("finalize_{}", p.function).c_str());
  }
  for (const KeyFile& k : kKeyFiles) {
    dds_qset_prop(qos, k.property, ("file:" + (keys / k.file).string()).c_str());
  }
  if (!has_revocations) return;
  dds_qset_prop(qos, "org.eclipse.cyclonedds.sec.auth.crl",
                ("file:" + (keys / "crl.pem").string()).c_str());
}

/// DDS rejects an identity whose validity has ended, but does not name the file.
Result<dds::Identity> valid_identity(const std::string& keys, const std::string& vehicle) {
  Result<dds::Identity> identity = dds::read_identity(keys);
  if (!identity) {
    return Error{"[gateway.security] directory: " + identity.error().message};
  }
  const dds::Validity& validity = identity->validity;
  const std::int64_t now = wall_utime();
  if (now < validity.end_utime) return identity;
  return Error{fmt::format("{}: expired at {}, and the clock of this computer is at {}: {}",
                           validity.path, dds::end_text(validity), dds::end_text({"", now}),
                           dds::renewal_text(validity, vehicle))};
}

Error failure(std::string_view what, dds_return_t code) {
  return {fmt::format("DDS: cannot create the {}: {}", what, dds_strretcode(-code))};
}

// An outdated state is of no use: no sample is sent again, and slow readers lose samples.
Qos state_qos(const std::string& vehicle) {
  Qos q = make_qos();
  dds_qset_reliability(q.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(q.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_partition1(q.get(), vehicle.c_str());
  return q;
}

// A late joiner must receive the status of the nodes at once, and no change may be lost. A slow
// reader loses samples but never blocks the gateway (max_blocking_time 0).
Qos status_qos(const std::string& vehicle) {
  Qos q = make_qos();
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(q.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_durability_service(q.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_partition1(q.get(), vehicle.c_str());
  return q;
}

// Only the newest command of each operator counts. Best effort, although operators write reliably:
// operators repeat their commands, and a reliable reader at its limit would block the receive
// thread of Cyclone DDS, and with it the emergency stops.
Qos command_qos() {
  Qos q = make_qos();
  dds_qset_reliability(q.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(q.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_resource_limits(q.get(), 64, 64, 1);
  dds_qset_partition1(q.get(), "*");
  return q;
}

// No stop may be lost, and one that was engaged before this process started counts, too. Depth 8,
// so that a stop and its release within one cycle are both received. The number of instances is
// limited by StopAdmission: at a limit of DDS, a flood by one operator would block the stops of
// others for ever.
Qos stop_qos() {
  Qos q = make_qos();
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(q.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, 8);
  dds_qset_partition1(q.get(), "*");
  return q;
}

std::string partition_of_writer(dds_entity_t reader, dds_instance_handle_t writer) {
  std::string name;
  dds_builtintopic_endpoint_t* const endpoint = dds_get_matched_publication_data(reader, writer);
  if (endpoint == nullptr) return name;
  std::uint32_t n = 0;
  char** partitions = nullptr;
  if (dds_qget_partition(endpoint->qos, &n, &partitions)) {
    if (n == 1 && is_name(partitions[0])) name = partitions[0];
    for (std::uint32_t i = 0; i < n; ++i) dds_free(partitions[i]);
    dds_free(partitions);
  }
  dds_builtintopic_free_endpoint(endpoint);
  return name;
}

}  // namespace

Result<std::unique_ptr<DdsLink>> DdsLink::open(const DdsParams& params,
                                               const std::string& vehicle) {
  dds::log_without_waiting();
  std::unique_ptr<DdsLink> link(new DdsLink(vehicle));
  const auto domain = static_cast<dds_domainid_t>(params.network.domain);
  link->domain_ = dds::Entity(dds_create_domain(
      domain, dds::domain_xml(params.network, kMaxProcesses, kMaxSampleBytes).c_str()));
  if (!link->domain_.valid()) return failure("domain", link->domain_.get());

  const Qos participant_qos = make_qos();
  dds_qset_entity_name(participant_qos.get(), vehicle.c_str());
  if (!params.keys.empty()) {
    const Result<dds::Identity> identity = valid_identity(params.keys, vehicle);
    if (!identity) return identity.error();
    set_security(participant_qos.get(), params.keys, identity->revoked.has_value());
    link->identity_ = *identity;
  }
  link->participant_ = dds::Entity(dds_create_participant(domain, participant_qos.get(), nullptr));
  const dds_entity_t participant = link->participant_.get();
  if (!link->participant_.valid()) return failure("participant", participant);

  const auto topic = [&](const dds_topic_descriptor_t& type, const char* name) {
    return dds_create_topic(participant, &type, name, nullptr,
                            nullptr);  // deleted with participant_
  };
  const dds_entity_t state = topic(rcs_VehicleState_desc, "VehicleState");
  const dds_entity_t status = topic(rcs_NodeStatus_desc, "NodeStatus");
  const dds_entity_t command = topic(rcs_WaypointCommand_desc, "WaypointCommand");
  const dds_entity_t stop = topic(rcs_EmergencyStop_desc, "EmergencyStop");
  dds_topic_filter filter{};
  filter.mode = DDS_TOPIC_FILTER_SAMPLE_SAMPLEINFO_ARG;
  filter.f.sample_sampleinfo_arg = &DdsLink::admits;
  filter.arg = link.get();
  if (stop >= 0) {
    const dds_return_t set = dds_set_topic_filter_extended(stop, &filter);
    if (set != DDS_RETCODE_OK) return failure("filter of stops", set);
  }
  for (const dds_entity_t t : {state, status, command, stop}) {
    if (t < 0) return failure("topics", t);
  }
  link->state_writer_ =
      dds::Entity(dds_create_writer(participant, state, state_qos(vehicle).get(), nullptr));
  link->status_writer_ =
      dds::Entity(dds_create_writer(participant, status, status_qos(vehicle).get(), nullptr));
  link->command_reader_ =
      dds::Entity(dds_create_reader(participant, command, command_qos().get(), nullptr));
  link->stop_reader_ = dds::Entity(dds_create_reader(participant, stop, stop_qos().get(), nullptr));
  for (const dds::Entity* e :
       {&link->state_writer_, &link->status_writer_, &link->command_reader_, &link->stop_reader_}) {
    if (!e->valid()) return failure("readers and writers", e->get());
  }
  return link;
}

bool DdsLink::write(const rcs_VehicleState& sample) {
  const bool good = dds_write(state_writer_.get(), &sample) == DDS_RETCODE_OK;
  if (!good) ++write_failures_;
  return good;
}

bool DdsLink::write(const rcs_NodeStatus& sample) {
  const bool good = dds_write(status_writer_.get(), &sample) == DDS_RETCODE_OK;
  if (!good) ++write_failures_;
  return good;
}

/// Called by the receiving thread of DDS for each sample, before it is stored.
bool DdsLink::admits(const void* sample, const dds_sample_info_t* info, void* link) {
  auto* const self = static_cast<DdsLink*>(link);
  const auto& stop = *static_cast<const rcs_EmergencyStop*>(sample);
  const std::lock_guard lock(self->mutex_);
  return self->admission_.judge({stop.vehicle, stop.operator_id, info->publication_handle,
                                 stop.engage}) == StopAdmission::Verdict::kStored;
}

void DdsLink::update_writers() {
  dds_subscription_matched_status_t status{};
  if (dds_get_subscription_matched_status(stop_reader_.get(), &status) != DDS_RETCODE_OK) return;
  // A writer that goes changes the current count alone.
  const std::uint32_t changed = status.total_count + (status.total_count - status.current_count);
  if (changed == writers_changed_) return;
  writers_changed_ = changed;
  constexpr std::size_t kMax = 256;
  std::array<dds_instance_handle_t, kMax> writers{};
  const dds_return_t n =
      dds_get_matched_publications(stop_reader_.get(), writers.data(), writers.size());
  std::vector<StopAdmission::Writer> known;
  for (std::size_t k = 0; n > 0 && k < std::min<std::size_t>(static_cast<std::size_t>(n), kMax);
       ++k) {
    known.push_back({writers[k], partition_of_writer(stop_reader_.get(), writers[k])});
  }
  const std::lock_guard lock(mutex_);
  admission_.set_writers(known);
}

DdsLink::Stops DdsLink::take_stops() {
  update_writers();
  return Stops(stop_reader_.get());
}

bool DdsLink::take_unnamed_stop() {
  const std::lock_guard lock(mutex_);
  return admission_.take_unnamed_stop();
}

std::string DdsLink::partition_of(const Commands& samples, std::size_t i) const {
  return partition_of_writer(command_reader_.get(), samples.writer(i));
}

bool DdsLink::take_refused_release() {
  const std::lock_guard lock(mutex_);
  return admission_.take_refused_release();
}

// The writer may have ended since.
std::string DdsLink::partition_of(const Stops& samples, std::size_t i) {
  const std::lock_guard lock(mutex_);
  const std::string* const known = admission_.operator_of(samples.writer(i));
  return known != nullptr ? *known : partition_of_writer(stop_reader_.get(), samples.writer(i));
}

}  // namespace rcs::gateway
