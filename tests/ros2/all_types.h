#pragma once
// Every type that the mappings publish.

#include <set>
#include <string>

#include "lcmtypes/channel_types.h"
#include "rcs/ros2/converter.h"

namespace rcs::test {

template <class Visit, class T>
void visit_topic_type(Visit& visit, const ros2::Topic<T>& /*topic*/) {
  visit(static_cast<const T*>(nullptr));
}

/// Calls visit(static_cast<const T*>(nullptr)) for the type of every topic and of every channel,
/// once for each type.
template <class Visit>
void for_each_type(Visit visit) {
  std::set<std::string> done;
  const auto once = [&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    if (done.insert(ros2::type_name<T>()).second) visit(type);
  };
  ros2::for_each_topic([&](const auto& topic) { visit_topic_type(once, topic); });
  for (const channel::Info& c : channel::kAll) channel::with_type_of(c.name, once);
}

}  // namespace rcs::test
