#include "modules/ros2_bridge/dds_link.h"

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "rcs/cdr/cdr_writer.h"
#include "rcs/dds/log.h"
#include "ros2_topics.h"

namespace rcs::ros2_bridge {
namespace {

using dds::Qos;

constexpr int kMaxProcesses = 32;
constexpr std::uint32_t kXcdr1 = 1;  // version, as the serializer of Cyclone counts

struct TopicType {
  const char* name;
  const dds_topic_descriptor_t* descriptor;
};
constexpr TopicType kTypes[] = {
#include "ros2_topics.inc"
};

Error failure(std::string_view what, dds_return_t code) {
  return {fmt::format("DDS: cannot create the {}: {}", what, dds_strretcode(-code))};
}

Qos make_qos(dds_durability_kind_t durability, int depth) {
  Qos q = dds::make_qos();
  dds_qset_durability(q.get(), durability);
  dds_qset_history(q.get(), DDS_HISTORY_KEEP_LAST, depth);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(q.get(), 1, &xcdr1);
  return q;
}

// Reliable, because subscribers of ROS 2 are reliable by default, and a reliable writer matches
// every reader. A slow reader loses samples and never blocks the bridge (max_blocking_time 0).
Qos writer_qos(bool kept) {
  constexpr int kDepth = 10;
  constexpr int kKept = 100;
  Qos q = make_qos(kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE, kDepth);
  dds_qset_reliability(q.get(), DDS_RELIABILITY_RELIABLE, 0);
  if (kept) {
    dds_qset_durability_service(q.get(), 0, DDS_HISTORY_KEEP_LAST, kKept, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  return q;
}

// Best effort matches every writer, and an outdated measurement is of no use. Samples of this
// participant are not received: an output never becomes an input.
Qos reader_qos(int depth) {
  Qos q = make_qos(DDS_DURABILITY_VOLATILE, depth);
  dds_qset_reliability(q.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_ignorelocal(q.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return q;
}

/// What the serializer of Cyclone reads of a type.
ddsi_sertype_default serializer_of(const dds_topic_descriptor_t& d) {
  ddsi_sertype_default type{};
  type.type.size = d.m_size;
  type.type.align = d.m_align;
  type.type.flagset = d.m_flagset;
  type.type.ops.nops = dds_stream_countops(d.m_ops, d.m_nkeys, d.m_keys);
  type.type.ops.ops = const_cast<std::uint32_t*>(d.m_ops);
  return type;
}

Result<const dds_topic_descriptor_t*> type_of(const std::string& name) {
  const auto* at = std::find_if(std::begin(kTypes), std::end(kTypes),
                                [&](const TopicType& t) { return t.name == name; });
  if (at == std::end(kTypes)) return Error{fmt::format("DDS: the type {} is unknown", name)};
  return at->descriptor;
}

}  // namespace

std::string dds_topic_name(std::string_view topic) { return fmt::format("rt{}", topic); }

Result<std::unique_ptr<DdsLink>> DdsLink::open(const dds::Network& network,
                                               const std::vector<DdsOutput>& outputs,
                                               const std::vector<DdsInput>& inputs,
                                               std::size_t max_sample_bytes) {
  dds::log_without_waiting();
  std::unique_ptr<DdsLink> link(new DdsLink());
  const auto domain = static_cast<dds_domainid_t>(network.domain);
  link->domain_ = dds::Entity(
      dds_create_domain(domain, dds::domain_xml(network, kMaxProcesses, max_sample_bytes).c_str()));
  if (!link->domain_.valid()) return failure("domain", link->domain_.get());
  link->participant_ = dds::Entity(dds_create_participant(domain, nullptr, nullptr));
  if (!link->participant_.valid()) return failure("participant", link->participant_.get());
  for (const DdsOutput& output : outputs) {
    if (Outcome added = link->add(output); !added) return added.error();
  }
  for (const DdsInput& input : inputs) {
    if (Outcome added = link->add(input); !added) return added.error();
  }
  return link;
}

Result<dds_entity_t> DdsLink::make_topic(const std::string& topic,
                                         const dds_topic_descriptor_t* type) {
  const dds_entity_t made =
      dds_create_topic(participant_.get(), type, dds_topic_name(topic).c_str(), nullptr, nullptr);
  if (made < 0) return failure(topic, made);
  return made;  // deleted with participant_
}

Outcome DdsLink::add(const DdsOutput& output) {
  const Result<const dds_topic_descriptor_t*> type = type_of(output.type);
  if (!type) return type.error();
  const Result<dds_entity_t> topic = make_topic(output.topic, *type);
  if (!topic) return topic.error();
  dds::Entity writer(
      dds_create_writer(participant_.get(), *topic, writer_qos(output.kept).get(), nullptr));
  if (!writer.valid()) return failure("writer of " + output.topic, writer.get());
  writers_.push_back({std::move(writer), *type});
  return Done{};
}

Outcome DdsLink::add(const DdsInput& input) {
  const Result<const dds_topic_descriptor_t*> type = type_of(input.type);
  if (!type) return type.error();
  const Result<dds_entity_t> topic = make_topic(input.topic, *type);
  if (!topic) return topic.error();
  dds::Entity reader(
      dds_create_reader(participant_.get(), *topic, reader_qos(input.depth).get(), nullptr));
  if (!reader.valid()) return failure("reader of " + input.topic, reader.get());
  readers_.push_back(std::move(reader));
  return Done{};
}

// Cyclone 0.10 gives no access to the type that dds_writecdr() needs: the payload is read into the
// memory layout of idlc, and written from there.
bool DdsLink::write(std::size_t output, const std::vector<std::uint8_t>& cdr) {
  const Writer& writer = writers_[output];
  const ddsi_sertype_default type = serializer_of(*writer.type);
  sample_.assign((writer.type->m_size + 7) / 8, 0);
  dds_istream_t in;
  dds_istream_init(&in, static_cast<std::uint32_t>(cdr.size() - cdr::kHeader.size()),
                   cdr.data() + cdr::kHeader.size(), kXcdr1);
  dds_stream_read_sample(&in, sample_.data(), &type);
  const dds_return_t written = dds_write(writer.entity.get(), sample_.data());
  dds_stream_free_sample(sample_.data(), writer.type->m_ops);
  return written == DDS_RETCODE_OK;
}

void DdsLink::take(std::size_t input, const std::function<void(const DdsSample&)>& receive) {
  std::array<ddsi_serdata*, kMaxSamples> samples{};
  std::array<dds_sample_info_t, kMaxSamples> infos{};
  const dds_return_t n =
      dds_takecdr(readers_[input].get(), samples.data(), kMaxSamples, infos.data(), DDS_ANY_STATE);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(n, 0)); ++i) {
    ddsi_serdata* const serdata = samples[i];
    if (infos[i].valid_data) {
      const std::uint32_t size = ddsi_serdata_size(serdata);
      ddsrt_iovec_t bytes{};
      ddsi_serdata* const held = ddsi_serdata_to_ser_ref(serdata, 0, size, &bytes);
      receive(
          {static_cast<const std::uint8_t*>(bytes.iov_base), size, infos[i].publication_handle});
      ddsi_serdata_to_ser_unref(held, &bytes);
    }
    ddsi_serdata_unref(serdata);
  }
}

}  // namespace rcs::ros2_bridge
