#pragma once
// Assembles the facets of a scan, converting each on arrival, so that only the registration remains
// after the last facet.

#include <cstdint>
#include <vector>

#include "modules/sp/scan/range_image.h"
#include "modules/sp/scan/scan.h"

namespace rcs::sp {

/// The scan of a facet, and its number in it.
struct FacetId {
  std::int64_t scan = 0;
  Stamp reference;
  int facet = 0;
  int facet_count = 0;  ///< [1, 1024]
};

enum class FacetVerdict {
  kAdded,
  kRepeated,  ///< this facet of this scan was received before
  kOld,       ///< of an earlier scan than the current one
  kNewScan,   ///< of a later scan: finish the current one, then add the facet again
};

class ScanAssembler {
 public:
  static constexpr int kMaxFacets = 1024;

  explicit ScanAssembler(const LadarParams& params) : calibration_(params) {}

  /// Facet is RangeFacet or PointFacet.
  template <class Facet>
  FacetVerdict add(const FacetId& id, const Facet& facet) {
    const FacetVerdict verdict = admit(id);
    if (verdict == FacetVerdict::kAdded) accumulate(calibration_.append(facet, &scan_));
    return verdict;
  }

  [[nodiscard]] bool in_hand() const { return received_ > 0; }
  [[nodiscard]] bool complete() const { return in_hand() && received_ == facet_count_; }
  [[nodiscard]] int facets_missing() const { return facet_count_ - received_; }
  [[nodiscard]] std::int64_t scan_id() const { return scan_id_; }
  [[nodiscard]] const ConversionCount& count() const { return count_; }

  /// The current scan, modified in place; release() makes room for the next.
  [[nodiscard]] Scan* scan() { return &scan_; }
  void release();

 private:
  FacetVerdict admit(const FacetId& id);
  void accumulate(const ConversionCount& count);

  Calibration calibration_;
  Scan scan_;
  ConversionCount count_;
  std::int64_t scan_id_ = -1;  // of the current scan, or of the last released one
  int facet_count_ = 0;
  int received_ = 0;
  std::vector<bool> seen_;
};

}  // namespace rcs::sp
