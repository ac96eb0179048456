#pragma once
// Names of the constants of messages. An invalid value gives "?".

#include <string_view>

namespace rcs::recording {

[[nodiscard]] std::string_view nav_mode_name(int mode);             ///< nav_state_t::MODE_*
[[nodiscard]] std::string_view status_name(int status);             ///< status_t::STATUS_*
[[nodiscard]] std::string_view source_status_name(int status);      ///< integrity_t::STATUS_*
[[nodiscard]] std::string_view innovation_source_name(int source);  ///< innovation_t::SOURCE_*
[[nodiscard]] std::string_view innovation_reason_name(int reason);  ///< innovation_t::REASON_*
[[nodiscard]] std::string_view stop_name(int stop);                 ///< registration_t::STOP_*

}  // namespace rcs::recording
