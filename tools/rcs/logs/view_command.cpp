// rcs view

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "tools/rcs/command.h"
#include "tools/rcs/vehicle/child_process.h"
#include "tools/view/view_options.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kViewName = "view";
constexpr char kProgram[] = "rcs_view";

/// Runs the program rcs_view in the place of this one: it needs Boost, and `rcs` does not.
class View final : public Command {
 public:
  explicit View(CLI::App* rcs)
      : Command(rcs->add_subcommand("view", "Show a run or the bus in a browser")) {
    view::add_view_options(app(), &options_);
  }

  int run() override {
    if (const Outcome checked = view::check(options_); !checked) {
      return wrong_usage(kViewName, checked.error());
    }
    const Result<std::string> program = find_program(kProgram);
    if (!program) {
      return fail(kViewName, {program.error().message +
                              "; it is built where Boost is installed: `tools/setup --view`, then "
                              "`tools/build rcs_view`"});
    }
    std::vector<std::string> arguments = view::to_arguments(options_);
    arguments.insert(arguments.begin(), kProgram);
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    (void)std::fflush(nullptr);
    execv(program->c_str(), argv.data());
    return fail(kViewName, {fmt::format("cannot execute {}: {}", *program, std::strerror(errno))});
  }

 private:
  view::ViewOptions options_;
};

}  // namespace

void add_view_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<View>(rcs));
}

}  // namespace rcs::cli
