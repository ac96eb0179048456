#pragma once
// Maps the name of a channel to its message type.

#include <string_view>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/message_fields.hpp"

namespace rcs::channel {

/// Calls visit(static_cast<const T*>(nullptr)) with the message type T of the channel.
/// @return false: the name is not a channel of this system
template <class Visit>
bool with_type_of(std::string_view channel, Visit&& visit) {
#define RCS_CHANNEL_CASE(constant, name, kind, type, writer, rate) \
  if (channel == (constant)) {                                     \
    visit(static_cast<const type*>(nullptr));                      \
    return true;                                                   \
  }
  RCS_CHANNELS(RCS_CHANNEL_CASE)
#undef RCS_CHANNEL_CASE
  return false;
}

}  // namespace rcs::channel
