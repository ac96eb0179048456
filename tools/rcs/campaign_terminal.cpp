#include "tools/rcs/campaign_terminal.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <thread>

#include "tools/rcs/terminal.h"

namespace rcs::cli {
namespace {

/// Steps of the progress bar.

Outcome make_folder(const std::string& path) {
  if (path.empty()) return Done{};
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return Error{path + ": " + error.message()};
  return Done{};
}

}  // namespace

Result<std::vector<drills::DrillResult>> run_campaign_at_terminal(std::string_view command,
                                                                  const std::string& out_folder,
                                                                  int jobs,
                                                                  drills::DrillCampaign campaign) {
  if (Outcome made = make_folder(out_folder); !made) return made.error();
  campaign.jobs = jobs > 0 ? static_cast<std::size_t>(jobs)
                           : std::max<std::size_t>(1, std::thread::hardware_concurrency());
  const InterruptGuard interrupt;
  Progress bar(command, Progress::kSteps);
  campaign.stop = [&interrupt] { return interrupt.requested(); };
  campaign.progress = [&bar](double share) {
    bar.at(static_cast<std::int64_t>(static_cast<double>(Progress::kSteps) * share));
  };
  return drills::run_campaign(campaign);
}

}  // namespace rcs::cli
