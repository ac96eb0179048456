// rcs why

#include <fmt/format.h>

#include "tools/rcs/command.h"
#include "tools/studies/explanation.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kName = "why";

class Why final : public Command {
 public:
  explicit Why(CLI::App* rcs)
      : Command(rcs->add_subcommand("why", "What led to a moment of a run, from its log")) {
    app()
        ->add_option("LOG", log_, "of a run, with what the nodes said")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("TIME", time_s_, "seconds after the log's first message")
        ->required()
        ->check(CLI::NonNegativeNumber);
    app()->footer(
        "What had come in and how long ago; what WM took or refused in the last second, and why;\n"
        "SP's last answers; WM's mode, trust and alerts; what BG did; the events before.\n"
        "Examples:\n"
        "  rcs drill config/drills/gps/d04_ramp_0_5.toml -o out/d04 --logs\n"
        "  rcs why out/d04/d04_ramp_0_5.log 49.5");
  }

  int run() override {
    Result<LogReader> reader = LogReader::open(log_);
    if (!reader) return fail(kName, reader.error());
    const Result<std::string> story = studies::why_story(&reader.value(), from_seconds(time_s_));
    if (!story) return fail(kName, story.error());
    fmt::print("{}", *story);
    return kExitOk;
  }

 private:
  std::string log_;
  double time_s_ = 0.0;
};

}  // namespace

void add_why_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Why>(rcs));
}

}  // namespace rcs::cli
