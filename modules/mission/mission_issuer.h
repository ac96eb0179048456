#pragma once
// The name by which the vehicle level issues commands and queries.

namespace rcs::mission {

constexpr char kIssuer[] = "mission";

}  // namespace rcs::mission
