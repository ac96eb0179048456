#include "modules/sp/scan/scan_assembler.h"

#include "rcs/base/check.h"

namespace rcs::sp {

FacetVerdict ScanAssembler::admit(const FacetId& id) {
  RCS_CHECK(id.facet_count >= 1 && id.facet_count <= kMaxFacets && id.facet >= 0 &&
            id.facet < id.facet_count);
  if (in_hand() && (id.scan > scan_id_ || id.facet_count != facet_count_)) {
    return FacetVerdict::kNewScan;
  }
  // Far back: the writer was restarted and counts from the start.
  constexpr std::int64_t kRestart = 100;
  if (id.scan < scan_id_ - kRestart && in_hand()) return FacetVerdict::kNewScan;
  if (!in_hand()) {
    if (id.scan <= scan_id_ && id.scan >= scan_id_ - kRestart) return FacetVerdict::kOld;
    scan_.clear();
    scan_.reference = id.reference;
    count_ = {};
    scan_id_ = id.scan;
    facet_count_ = id.facet_count;
    seen_.assign(static_cast<std::size_t>(id.facet_count), false);
  } else if (id.scan < scan_id_) {
    return FacetVerdict::kOld;
  }
  const auto f = static_cast<std::size_t>(id.facet);
  if (seen_[f]) return FacetVerdict::kRepeated;
  seen_[f] = true;
  ++received_;
  return FacetVerdict::kAdded;
}

void ScanAssembler::accumulate(const ConversionCount& count) {
  count_.returns += count.returns;
  count_.missing += count.missing;
  count_.lone += count.lone;
  count_.rejected += count.rejected;
  count_.not_finite += count.not_finite;
}

void ScanAssembler::release() { received_ = 0; }

}  // namespace rcs::sp
