#include "tools/studies/message_history.h"

#include <cstddef>
#include <string_view>
#include <utility>

#include "lcmtypes/channels.h"

namespace rcs::studies {
namespace {

constexpr std::size_t kInnovations = 2000;
constexpr std::size_t kRegistrations = 4;
constexpr std::size_t kEventsKept = 12;

template <class T>
void keep(const LogEvent& event, std::size_t max, std::deque<Received<T>>* kept) {
  Received<T> received{event.stamp, {}};
  const int size = static_cast<int>(event.data.size());
  if (received.message.decode(event.data.data(), 0, size) != size) return;
  kept->push_back(std::move(received));
  if (kept->size() > max) kept->pop_front();
}

}  // namespace

void MessageHistory::add(const LogEvent& event) {
  now = event.stamp;
  const std::string& c = event.channel;
  std::deque<Stamp>& arrivals = inputs[c];
  arrivals.push_back(event.stamp);
  while (event.stamp - arrivals.front() > kRecent) arrivals.pop_front();
  if (c == channel::kWmInnovation) keep(event, kInnovations, &innovations);
  if (c == channel::kSpRegistration) keep(event, kRegistrations, &registrations);
  if (c == channel::kWmNavState) keep(event, 1, &nav);
  if (c == channel::kWmIntegrity) keep(event, 1, &integrity);
  if (c == channel::kBgDrive) keep(event, 1, &drive);
  if (c == channel::kBgPlan) keep(event, 1, &plan);
  if (c == channel::kBgStatus) keep(event, 1, &status);
  if (c == channel::kMissionStatus) keep(event, 1, &mission_status);
  if (c == channel::kMissionRoutes) keep(event, 1, &routes);
  constexpr std::string_view kEventChannels = "_EVENT";
  const bool is_event =
      c.size() > kEventChannels.size() &&
      c.compare(c.size() - kEventChannels.size(), std::string::npos, kEventChannels) == 0;
  if (is_event) keep(event, kEventsKept, &events);
}

}  // namespace rcs::studies
