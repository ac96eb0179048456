#pragma once
// The command line of the program `sim`.

#include <string>
#include <tuple>
#include <vector>

#include "sim/scenario_file.h"

namespace CLI {
class App;
}

namespace rcs::sim {

struct SimOptions {
  std::string scenario;
  std::string lcm_url;
  ScenarioOverrides overrides;       ///< without the outages
  std::vector<double> gps_outage_s;  ///< begin, length; empty: those of the file
  std::vector<double> ladar_outage_s;
  std::vector<std::tuple<std::string, double, double>> silences;  ///< source, begin, length [s]
};

/// Name, description, options and example of the program.
/// @param options  filled by the parser; must outlive it
void add_sim_options(CLI::App* app, SimOptions* options);

}  // namespace rcs::sim
