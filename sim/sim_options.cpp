#include "sim/sim_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "rcs/node/bus/lcm_bus.h"

namespace rcs::sim {

void add_sim_options(CLI::App* app, SimOptions* options) {
  app->name("sim");
  app->description(
      "Reference simulation: drives a scenario and publishes its sensors at real time. A scenario\n"
      "with [drive] mode = \"commanded\" receives BG_DRIVE, and stops without a valid command.");
  app->add_option("SCENARIO", options->scenario, "config/sim/*.toml")->required();
  app->add_option(
      "--lcm-url", options->lcm_url,
      fmt::format("URL of the LCM bus; default: $LCM_DEFAULT_URL, else {}", kDefaultLcmUrl));
  app->add_option("--seed", options->overrides.seed,
                  "seed of the noise, instead of that of the file");
  app->add_option("--ins", options->overrides.ins_grade,
                  "INS grade: tactical, industrial, consumer");
  app->add_option("--gps-outage", options->gps_outage_s,
                  "BEGIN,LENGTH [s] of a GPS outage, instead of those of the file")
      ->delimiter(',')
      ->expected(2);
  app->add_option("--gps-lost-after", options->overrides.gps_lost_after_m,
                  "distance [m] after which GPS is lost for the rest of the drive, instead of that "
                  "of the file");
  app->add_option("--ladar-outage", options->ladar_outage_s,
                  "BEGIN,LENGTH [s] of a LADAR outage, instead of those of the file")
      ->delimiter(',')
      ->expected(2);
  app->add_option("--silence", options->silences,
                  "SOURCE,BEGIN,LENGTH: SOURCE publishes nothing from BEGIN s on for LENGTH "
                  "s;\nSOURCE is ins, gps, odometry, ladar or all")
      ->delimiter(',')
      ->check(CLI::Validator(
          [](std::string& value) {
            const bool number = value.find_first_not_of("0123456789.e+") == std::string::npos;
            const bool source = value == "ins" || value == "gps" || value == "odometry" ||
                                value == "ladar" || value == "all";
            return number || source ? std::string()
                                    : value + ": not ins, gps, odometry, ladar, all or seconds";
          },
          ""));
  app->footer(
      "Exit status: 0 the drive is over; 2 invalid command line; 3 SCENARIO is invalid, or the "
      "bus\n"
      "failed; 130 interrupted (Ctrl-C, SIGTERM) before the end.\n"
      "Example:\n  sim config/sim/demo.toml --gps-outage 60,60");
}

}  // namespace rcs::sim
