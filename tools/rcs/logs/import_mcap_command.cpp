// rcs import mcap

#include <fmt/format.h>

#include "rcs/node/log/log_file.h"
#include "tools/base/files.h"
#include "tools/mcap/log_import.h"
#include "tools/mcap/mcap_file.h"
#include "tools/rcs/logs/mcap_commands.h"
#include "tools/rcs/terminal.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

class ImportMcap final : public Command {
 public:
  explicit ImportMcap(CLI::App* import)
      : Command(import->add_subcommand("mcap", "Import the messages of `rcs log mcap`")) {
    app()
        ->add_option("FILE", file_, "MCAP file with topics /rcs/CHANNEL")
        ->required()
        ->check(CLI::ExistingFile);
    app()->add_option("-o,--out", out_, "output log")->type_name("FILE")->required();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Reads the topics /rcs/CHANNEL of type rcs_msgs/msg/X, which `rcs log mcap` writes "
        "without\n"
        "loss: a log whose channels are all of this system comes back with the same events. Other\n"
        "topics are skipped and counted. A truncated file is read to its last complete chunk.\n"
        "Exit status 1 if the file is damaged or truncated, or has no such message; what is\n"
        "readable is written.\n"
        "Example:\n"
        "  rcs import mcap run.mcap -o run.log");
  }

  int run() override {
    const tools::OutputFile out(out_);
    if (Outcome checked = out.check(); !checked) return fail(kImportName, checked.error());
    Result<mcap::Reader> reader = mcap::open_file(file_);
    if (!reader) return fail(kImportName, reader.error());
    Result<LogWriter> writer = LogWriter::create(out.write_path());
    if (!writer) return fail(kImportName, writer.error());
    mcap::LogImport import(file_, &reader.value(), &writer.value());
    Outcome done = copy(&reader.value(), &import);
    if (done) done = writer->close();
    if (!done) return fail(kImportName, done.error());
    if (!reader->unknown_compression().empty()) {
      return fail(kImportName, {fmt::format("{}: compression {} is not supported; zstd is", file_,
                                            reader->unknown_compression())});
    }
    if (writer->events() == 0) {
      if (json_) report_result(*reader, import.counts(), 0);
      return negative(kImportName,
                      {fmt::format("{}: no message on a topic /rcs/CHANNEL of our types; {}", file_,
                                   reader->health().summary())});
    }
    if (done = out.commit(); !done) return fail(kImportName, done.error());
    report_result(*reader, import.counts(), writer->events());
    return reader->health().good() && import.counts().malformed == 0 ? kExitOk : kExitNegative;
  }

 private:
  static constexpr std::string_view kImportName = "import mcap";

  static Outcome copy(mcap::Reader* reader, mcap::LogImport* import) {
    const InterruptGuard interrupt;
    Progress progress(kImportName, static_cast<std::int64_t>(reader->size_bytes()));
    mcap::Message message;
    while (reader->next(&message)) {
      progress.at(static_cast<std::int64_t>(reader->position_bytes()));
      if (interrupt.requested()) return Error{"interrupted"};
      if (Outcome added = import->add(message); !added) return added;
    }
    return Done{};
  }

  void report_result(const mcap::Reader& reader, const mcap::ImportCounts& counts,
                     std::int64_t events) const {
    const mcap::ReaderHealth& health = reader.health();
    if (json_) {
      report::Json json = {{"log", events > 0 ? report::Json(out_) : report::Json()},
                           {"events", events},
                           {"malformed", counts.malformed},
                           {"bad_times", counts.bad_times},
                           {"complete", health.complete},
                           {"damaged_chunks", health.damaged_chunks},
                           {"malformed_records", health.lost_records},
                           {"checksum_differs", health.checksum_differs},
                           {"skipped_topics", report::Json::object()}};
      for (const auto& [topic, n] : counts.skipped) json["skipped_topics"][topic] = n;
      fmt::print("{}", report::json_document(kImportName, json));
      return;
    }
    std::int64_t skipped = 0;
    for (const auto& [topic, n] : counts.skipped) skipped += n;
    fmt::print(stderr, "{}: {} events; skipped: {} messages on {} other topics\n", out_, events,
               skipped, counts.skipped.size());
    if (counts.malformed + counts.bad_times > 0) {
      fmt::print(stderr,
                 "skipped: {} messages not decodable, {} with a time that no log can have\n",
                 counts.malformed, counts.bad_times);
    }
    if (!health.good()) {
      fmt::print(stderr, "rcs {}: {}: {}\n", kImportName, file_, health.summary());
    }
  }

  std::string file_;
  std::string out_;
  bool json_ = false;
};

}  // namespace

void add_import_mcap_command(CLI::App* import, Commands* commands) {
  commands->push_back(std::make_unique<ImportMcap>(import));
}

}  // namespace rcs::cli
