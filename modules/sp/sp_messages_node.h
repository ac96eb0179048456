#pragma once
// SP's messages: the validation of facets, and the conversion of results.

#include <cstddef>
#include <optional>

#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/registration/registration.h"
#include "modules/sp/scan/range_image.h"
#include "modules/sp/scan/scan_assembler.h"

namespace rcs::sp {

/// Points in one points_t: 48 kB, one datagram.
constexpr std::size_t kPointsPerMessage = 4000;

/// The scan of a facet; none if the facet does not match the LADAR or its own counts.
[[nodiscard]] std::optional<FacetId> identify(const ladar_ranges_t& m, const LadarParams& ladar);
[[nodiscard]] std::optional<FacetId> identify(const ladar_points_t& m, const LadarParams& ladar);

/// View of an identified facet; valid as long as the message.
[[nodiscard]] RangeFacet view(const ladar_ranges_t& m);
[[nodiscard]] PointFacet view(const ladar_points_t& m);

/// Fills in the result of a registration, without tiles; the other fields are of the scan.
void fill(const registration::Registration& registration, int target, registration_t* m);

/// Points [begin, end) of a scan.
void fill(const Points& points, std::size_t begin, std::size_t end, points_t* m);

}  // namespace rcs::sp
