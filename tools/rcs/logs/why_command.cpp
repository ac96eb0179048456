// rcs why

#include <fmt/format.h>

#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"
#include "tools/studies/explanation.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kWhyName = "why";

class Why final : public Command {
 public:
  explicit Why(CLI::App* rcs)
      : Command(rcs->add_subcommand("why",
                                    "Explain the state of a run at a given time, from its log")) {
    app()
        ->add_option("LOG", log_, "log of a run, with the output of the nodes")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("TIME", time_s_, "time after the first message of the log [s]")
        ->required()
        ->check(CLI::NonNegativeNumber);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Prints the age of the newest message of each sensor; the measurements that WM accepted "
        "or\n"
        "rejected in the last second, with reasons; the last registrations of SP; the mode, "
        "source\n"
        "status and alerts of WM; the state of the mission, its candidate routes with their "
        "values and\n"
        "why they were not chosen; the state of BG; the preceding events.\n"
        "Examples:\n"
        "  rcs drill config/drills/gps/d04_ramp_0_5.toml -o out/d04 --logs\n"
        "  rcs why out/d04/d04_ramp_0_5.log 49.5");
  }

  int run() override {
    Result<LogReader> reader = LogReader::open(log_);
    if (!reader) return fail(kWhyName, reader.error());
    const Result<studies::Explanation> explained = [&] {
      const InterruptGuard interrupt;
      Progress progress(kWhyName, Progress::kSteps);
      return studies::explain(&reader.value(), from_seconds(time_s_), [&](double share) {
        progress.at_share(share);
        return !interrupt.requested();
      });
    }();
    if (!explained) return fail(kWhyName, explained.error());
    if (!reader->health().good()) {
      fmt::print(stderr, "rcs why: {}: {}\n", log_, reader->health().summary());
    }
    if (json_) {
      fmt::print("{}", report::json_document(kWhyName, explained->json));
    } else {
      fmt::print("{}\nIn the viewer: rcs view {}, then http://127.0.0.1:8765/#t={:.1f}\n",
                 explained->text, shell_word(log_), time_s_);
    }
    return kExitOk;
  }

 private:
  std::string log_;
  double time_s_ = 0.0;
  bool json_ = false;
};

}  // namespace

void add_why_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Why>(rcs));
}

}  // namespace rcs::cli
