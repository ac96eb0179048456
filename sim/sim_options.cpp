#include "sim/sim_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"

namespace rcs::sim {

void add_sim_options(CLI::App* app, SimOptions* options) {
  app->name("sim");
  app->description(
      "Reference simulation: drives a scenario and publishes its sensors in real time. A scenario\n"
      "with [drive] mode = \"commanded\" receives BG_DRIVE, and stops without a valid command.");
  app->add_option("SCENARIO", options->scenario, "scenario (TOML), e.g. config/sim/demo.toml")
      ->transform(command_line::config_path())
      ->type_name("FILE")
      ->required();
  add_bus_option(app, &options->lcm_url);
  app->add_option("--seed", options->overrides.seed,
                  "seed of the noise, instead of that of the scenario");
  app->add_option("--ins", options->overrides.ins_grade,
                  "INS grade (tactical, industrial or consumer), instead of that of the scenario")
      ->type_name("GRADE");
  app->add_option("--gps-outage", options->gps_outage_s,
                  "begin and length of a GPS outage [s], instead of the outages of the scenario")
      ->type_name("BEGIN,LENGTH")
      ->delimiter(',')
      ->expected(2);
  app->add_option("--gps-lost-after", options->overrides.gps_lost_after_m,
                  "distance after which GPS is lost for the rest of the drive [m], instead of that "
                  "of the scenario");
  app->add_option("--ladar-outage", options->ladar_outage_s,
                  "begin and length of a LADAR outage [s], instead of the outages of the scenario")
      ->type_name("BEGIN,LENGTH")
      ->delimiter(',')
      ->expected(2);
  app->add_option("--silence", options->silences,
                  "SOURCE (ins, gps, odometry, ladar or all) publishes nothing from BEGIN on for "
                  "LENGTH [s]; may be repeated")
      ->type_name("SOURCE,BEGIN,LENGTH")
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
