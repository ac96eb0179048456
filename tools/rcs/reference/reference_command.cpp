// rcs reference

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/reference/pages.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kReferenceName = "reference";

using Files = std::vector<std::pair<std::string, std::string>>;  // path, text

/// @return exit status
int write(const Files& files) {
  for (const auto& [path, text] : files) {
    if (const Outcome written = tools::write_text(path, text); !written) {
      return fail(kReferenceName, written.error());
    }
  }
  return kExitOk;
}

class Pages final : public Command {
 public:
  Pages(CLI::App* reference, const CLI::App* rcs)
      : Command(reference->add_subcommand(
            "pages", "Write cli.md, configuration.md, messages.md and events.md")),
        rcs_(rcs) {
    app()
        ->add_option("-o,--out", out_, "output folder")
        ->type_name("FOLDER")
        ->capture_default_str();
    app()
        ->add_option("--lcmtypes", lcmtypes_, "folder of the message definitions")
        ->type_name("FOLDER")
        ->capture_default_str();
    app()->footer("Example:\n  rcs reference pages");
  }

  int run() override {
    const Result<std::vector<LcmType>> types = read_lcm_files(lcmtypes_);
    if (!types) return fail(kReferenceName, types.error());
    return write({{out_ + "/cli.md", cli_page(command_line::program_text(*rcs_, "rcs"))},
                  {out_ + "/configuration.md", configuration_page()},
                  {out_ + "/messages.md", messages_page(*types)},
                  {out_ + "/events.md", events_page()}});
  }

 private:
  const CLI::App* rcs_;
  std::string out_ = "docs/reference";
  std::string lcmtypes_ = "lcmtypes";
};

class Man final : public Command {
 public:
  Man(CLI::App* reference, const CLI::App* rcs)
      : Command(reference->add_subcommand(
            "man",
            "Write a man page for rcs, for each of its commands and for the other programs")),
        rcs_(rcs) {
    app()->add_option("-o,--out", out_, "output folder")->type_name("FOLDER")->required();
    app()->footer("Example:\n  rcs reference man -o man1 && man -l man1/rcs-replay.1");
  }

  int run() override {
    const ProgramText rcs = command_line::program_text(*rcs_, "rcs");
    Files files{{out_ + "/rcs.1", man_page(rcs, rcs)}};
    std::vector<ProgramText> programs = other_programs();
    programs.insert(programs.end(), rcs.commands.begin(), rcs.commands.end());
    for (const ProgramText& p : programs) {
      files.emplace_back(fmt::format("{}/{}.1", out_, hyphenated(p.name)), man_page(p, rcs));
    }
    return write(files);
  }

 private:
  const CLI::App* rcs_;
  std::string out_;
};

class Completion final : public Command {
 public:
  Completion(CLI::App* reference, const CLI::App* rcs)
      : Command(reference->add_subcommand("completion", "Write the completion of rcs for bash")),
        rcs_(rcs) {
    app()->add_option("-o,--out", out_, "output file")->type_name("FILE")->required();
    app()->footer("Example:\n  rcs reference completion -o rcs.bash && source rcs.bash");
  }

  int run() override {
    return write({{out_, bash_completion(command_line::program_text(*rcs_, "rcs"))}});
  }

 private:
  const CLI::App* rcs_;
  std::string out_;
};

}  // namespace

void add_reference_commands(CLI::App* rcs, Commands* commands) {
  CLI::App* reference = rcs->add_subcommand(
      "reference", "Write the reference pages, the man pages or the completion of this program");
  reference->require_subcommand(1);
  reference->footer(
      "All texts derive from this program: the commands, the parsers of the configuration, and "
      "the\n"
      "lists of channels and events.");
  commands->push_back(std::make_unique<Pages>(reference, rcs));
  commands->push_back(std::make_unique<Man>(reference, rcs));
  commands->push_back(std::make_unique<Completion>(reference, rcs));
}

}  // namespace rcs::cli
