#include "tools/driving/source_losses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "lcmtypes/channels.h"
#include "sim/base/random.h"
#include "sim/simulator.h"

namespace rcs::driving {
namespace {

constexpr int kLosses = 3;
constexpr double kFirst_s = 10.0;
constexpr double kLast_s = 80.0;
constexpr double kShortest_s = 2.0;
constexpr double kLongest_s = 60.0;

}  // namespace

std::vector<SourceLoss> draw_losses(std::uint64_t seed) {
  const std::array<SourceLoss, 4> sources = {
      SourceLoss{"GPS", {std::string(channel::kGpsFix)}, 0.0, 0.0},
      SourceLoss{"LADAR",
                 {std::string(channel::kLadarRanges), std::string(channel::kLadarPoints)},
                 0.0,
                 0.0},
      SourceLoss{"INS", {std::string(channel::kIns)}, 0.0, 0.0},
      SourceLoss{"wheels", {std::string(channel::kOdometry)}, 0.0, 0.0}};
  sim::Random random(seed, sim::Stream::kLosses);
  std::vector<SourceLoss> out;
  for (int k = 0; k < kLosses; ++k) {
    const auto which =
        static_cast<std::size_t>(random.uniform() * static_cast<double>(sources.size()));
    SourceLoss loss = sources[std::min(which, sources.size() - 1)];
    loss.begin_s = kFirst_s + (kLast_s - kFirst_s) * random.uniform();
    // As many from 2 to 11 s as from 11 to 60 s.
    loss.end_s = loss.begin_s + kShortest_s * std::pow(kLongest_s / kShortest_s, random.uniform());
    out.push_back(std::move(loss));
  }
  std::sort(out.begin(), out.end(),
            [](const SourceLoss& a, const SourceLoss& b) { return a.begin_s < b.begin_s; });
  return out;
}

std::string describe(const std::vector<SourceLoss>& losses) {
  std::string text;
  for (const SourceLoss& loss : losses) {
    text += fmt::format("{}{} {:.0f} to {:.0f} s", text.empty() ? "" : ", ", loss.source,
                        loss.begin_s, loss.end_s);
  }
  return text;
}

void WithLosses::take(SourceEvent* event) {
  const double now_s = seconds(source_->peek() - sim::Simulator::kStart);
  source_->take(event);
  const bool lost = std::any_of(losses_.begin(), losses_.end(), [&](const SourceLoss& loss) {
    return now_s >= loss.begin_s && now_s < loss.end_s &&
           std::find(loss.channels.begin(), loss.channels.end(), event->channel) !=
               loss.channels.end();
  });
  if (lost) event->channel.clear();
}

}  // namespace rcs::driving
