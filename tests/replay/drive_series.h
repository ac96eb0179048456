#pragma once
// A series of closed-loop drives as a test prints it.

#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "rcs/base/check.h"
#include "tests/replay/chain.h"
#include "tools/driving/drive_output.h"

namespace rcs::test {

inline int number_from(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);        // NOLINT(concurrency-mt-unsafe)
  return text == nullptr ? otherwise : std::atoi(text);  // NOLINT(cert-err34-c)
}

/// Drives the scenario with consecutive seeds and prints the table.
inline std::vector<driving::DriveRow> drive_series(driving::DriveCampaign campaign, int first_seed,
                                                   int drives) {
  if (campaign.vehicle_config.empty()) {
    campaign.vehicle_config = source_path("config/demo3.toml");
  }
  for (int k = 0; k < drives; ++k) campaign.seeds.push_back(first_seed + k);
  campaign.jobs = std::max(1U, std::thread::hardware_concurrency());
  campaign.stop = [] { return false; };
  campaign.progress = [](double) {};
  Result<std::vector<driving::DriveRow>> rows = driving::run_drives(campaign);
  RCS_CHECK(rows.ok());
  std::printf("%s%s", to_text(driving::drive_table(*rows)).c_str(),
              driving::drive_summary(*rows).c_str());
  std::fflush(stdout);
  return std::move(rows).value();
}

}  // namespace rcs::test
