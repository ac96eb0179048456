// rcs why

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <optional>

#include "tools/rcs/command.h"
#include "tools/rcs/page_origin.h"
#include "tools/rcs/terminal.h"
#include "tools/report/html_page.h"
#include "tools/report/json_document.h"
#include "tools/studies/explanation.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kWhyName = "why";
constexpr std::string_view kRouteName = "why route";
constexpr std::string_view kRoute = "route";

/// A time [s], finite and not negative.
std::optional<double> time_of(const std::string& text) {
  char* end = nullptr;
  const double time_s = std::strtod(text.c_str(), &end);
  const bool good = !text.empty() && *end == '\0' && std::isfinite(time_s) && !std::signbit(time_s);
  return good ? std::optional(time_s) : std::nullopt;
}

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
        ->add_option(
            "TIME", moment_,
            "time after the first message of the log [s]; or the word route: the candidate "
            "routes of every choice of the mission")
        ->type_name("SECONDS")
        ->required()
        ->check([](const std::string& text) -> std::string {
          return text == kRoute || time_of(text)
                     ? ""
                     : fmt::format("expected a number, at least 0, or route, not {}", text);
        });
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Prints the age of the newest message of each sensor; the measurements that WM accepted "
        "or\n"
        "rejected in the last second, with reasons; the last registrations of SP; the mode, "
        "source\n"
        "status and alerts of WM; the state of the mission, its candidate routes with their "
        "values and\n"
        "why they were not chosen; the state of BG; the preceding events. With route: the "
        "candidates "
        "of\n"
        "every choice of the mission with length, time, predicted level, verdict and reason.\n"
        "Examples:\n"
        "  rcs drill config/drills/gps/d04_ramp_0_5.toml -o out/d04 --logs\n"
        "  rcs why out/d04/d04_ramp_0_5.log 49.5\n"
        "  rcs why out/mission/drive_1.log route");
  }

  int run() override {
    Result<LogReader> reader = LogReader::open(log_);
    if (!reader) return fail(kWhyName, reader.error());
    const std::optional<double> time_s = time_of(moment_);
    const Result<studies::Explanation> explained = [&] {
      const InterruptGuard interrupt;
      Progress progress(kWhyName, Progress::kSteps);
      const auto proceed = [&](double share) {
        progress.at_share(share);
        return !interrupt.requested();
      };
      return time_s ? studies::explain(&reader.value(), from_seconds(*time_s), proceed)
                    : studies::explain_routes(&reader.value(), proceed);
    }();
    if (!explained) return fail(kWhyName, explained.error());
    if (!reader->health().good()) {
      fmt::print(stderr, "rcs why: {}: {}\n", log_, reader->health().summary());
    }
    if (json_) {
      fmt::print("{}", report::json_document(time_s ? kWhyName : kRouteName, explained->json));
    } else {
      fmt::print("{}", explained->text);
      if (time_s) {
        fmt::print("\nIn the viewer: rcs view {}, then {}\n", shell_word(log_),
                   report::viewer_link(log_, *time_s));
      }
    }
    return kExitOk;
  }

 private:
  std::string log_;
  std::string moment_;
  bool json_ = false;
};

}  // namespace

void add_why_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Why>(rcs));
}

}  // namespace rcs::cli
