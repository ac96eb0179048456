#pragma once
// What every subcommand of `rcs` has in common.

#include <CLI/CLI.hpp>
#include <memory>
#include <string_view>
#include <vector>

#include "rcs/base/exit_status.h"
#include "rcs/base/result.h"

namespace rcs::cli {

/// A subcommand; its options are its members, filled by the parser.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;

  [[nodiscard]] bool chosen() const { return app_->parsed(); }
  /// @return exit status
  virtual int run() = 0;

 protected:
  [[nodiscard]] CLI::App* app() { return app_; }

 private:
  CLI::App* app_;
};

using Commands = std::vector<std::unique_ptr<Command>>;

void add_consistency_command(CLI::App* rcs, Commands* commands);
void add_drill_command(CLI::App* rcs, Commands* commands);
void add_drive_command(CLI::App* rcs, Commands* commands);
void add_faults_command(CLI::App* rcs, Commands* commands);
void add_outages_command(CLI::App* rcs, Commands* commands);
void add_log_commands(CLI::App* rcs, Commands* commands);
/// @param log  the command `rcs log`
void add_log_cut_command(CLI::App* log, Commands* commands);
void add_record_command(CLI::App* rcs, Commands* commands);
void add_go_command(CLI::App* rcs, Commands* commands);
void add_mission_command(CLI::App* rcs, Commands* commands);
void add_import_commands(CLI::App* rcs, Commands* commands);
/// @param import  the command `rcs import`
void add_recording_imports(CLI::App* import, Commands* commands);
void add_map_commands(CLI::App* rcs, Commands* commands);
/// @param map  the command `rcs map`
void add_map_build_command(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_import_commands(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_localizability_command(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_locate_command(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_match_command(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_compare_commands(CLI::App* map, Commands* commands);
/// @param map  the command `rcs map`
void add_map_study_command(CLI::App* map, Commands* commands);
void add_eval_command(CLI::App* rcs, Commands* commands);
void add_sim_command(CLI::App* rcs, Commands* commands);
void add_report_command(CLI::App* rcs, Commands* commands);
void add_register_command(CLI::App* rcs, Commands* commands);
void add_play_command(CLI::App* rcs, Commands* commands);
void add_replay_command(CLI::App* rcs, Commands* commands);
void add_budget_command(CLI::App* rcs, Commands* commands);
void add_load_command(CLI::App* rcs, Commands* commands);
void add_predict_command(CLI::App* rcs, Commands* commands);
void add_table1_command(CLI::App* rcs, Commands* commands);
void add_config_commands(CLI::App* rcs, Commands* commands);
void add_keys_command(CLI::App* rcs, Commands* commands);
void add_reference_commands(CLI::App* rcs, Commands* commands);
void add_smooth_command(CLI::App* rcs, Commands* commands);
void add_why_command(CLI::App* rcs, Commands* commands);
void add_view_command(CLI::App* rcs, Commands* commands);
void add_up_command(CLI::App* rcs, Commands* commands);
void add_top_command(CLI::App* rcs, Commands* commands);

/// Prints what prevented the work to stderr. @return kExitInput
int fail(std::string_view command, const Error& error);
/// Prints the reason of a negative result to stderr. @return kExitNegative
int negative(std::string_view command, const Error& reason);
/// Prints what is wrong with the command line to stderr. @return kExitUsage
int wrong_usage(std::string_view command, const Error& error);

}  // namespace rcs::cli
