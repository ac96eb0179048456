#include "rcs/node/process/node_main.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <string>
#include <utility>

#include "rcs/base/exit_status.h"
#include "rcs/base/regular_file.h"
#include "rcs/command_line/parse.h"
#include "rcs/node/bus/bus_exposure.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/executor.h"
#include "rcs/node/process/bus_watch.h"
#include "rcs/node/process/cycle_sinks.h"
#include "rcs/node/process/node_options.h"
#include "rcs/node/process/process.h"
#include "rcs/node/process/publisher_watch.h"
#include "rcs/node/process/realtime.h"
#include "rcs/node/process/terminal_line.h"
#include "rcs/node/report.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs {
namespace {

int fail(std::string_view name, const Error& error) {
  fmt::print(stderr, "{}: {}\n", name, error.message);
  return kExitInput;
}

/// Builds the node on a bus without other nodes.
/// @return kExitNegative for a configuration that is invalid or that the node rejects
int check(std::string_view name, const NodeOptions& options, const NodeFactory& factory) {
  const auto reject = [&](const Error& error) {
    (void)fail(name, error);
    return kExitNegative;
  };
  const Result<ParamFile> params = ParamFile::load(options.config);
  if (!params) {
    const bool readable =
        check_regular_file(options.config).ok() && std::ifstream(options.config).good();
    return readable ? reject(params.error()) : fail(name, params.error());
  }
  const Result<ProcessTables> tables = read_process_tables(*params);
  if (!tables) return reject(tables.error());
  LocalBus bus;
  const Result<std::unique_ptr<Node>> node = factory(*params, &bus);
  if (!node) return reject(node.error());
  fmt::print("{}: {} is valid\n", name, options.config);
  return kExitOk;
}

/// `rcs up` gives its nodes a copy of the configuration, so that one that is restarted reads what
/// the others have read.
Result<ParamFile> load_config(const NodeOptions& options) {
  return options.copy.empty() ? ParamFile::load(options.config)
                              : ParamFile::load_copy(options.copy, options.config);
}

int run_live(std::string_view name, const NodeOptions& options, const NodeFactory& factory) {
  const Result<ParamFile> params = load_config(options);
  if (!params) return fail(name, params.error());
  const Result<ProcessTables> tables = read_process_tables(*params);
  if (!tables) return fail(name, tables.error());

  const StopSignals stop;
  const Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(options.url);
  if (!opened) return fail(name, opened.error());
  LcmBus* const bus = opened->get();
  Publisher publisher = bus->publisher();
  publisher.run_id = live_run_id(params->text_id());
  bus->set_publisher(publisher);
  bus->require_owners();
  EventPrinter printer(bus, name);  // before the node, which may report while it starts
  const Result<std::unique_ptr<Node>> node = factory(*params, bus);
  if (!node) return fail(name, node.error());
  if (const Outcome status = bus->status(); !status) return fail(name, status.error());

  LiveTimeline timeline(bus, &stop);
  CyclePublisher cycles(bus);
  CycleCounter counter(&cycles);
  // Last, when every thread and most of the memory exist.
  ProcessFacts facts{std::string(name),
                     options.config,
                     params->text_id(),
                     timeline.now(),
                     request_realtime(tables->realtime_of(std::string(name))),
                     reach_note(bus->url(), tables->bus_firewalled)};
  TerminalLines lines;
  for (const std::string& refusal : facts.grant.refusals) {
    lines.print(fmt::format("{}: {}", name, refusal));
  }
  if (!facts.reach_note.empty()) lines.print(fmt::format("{}: {}", name, facts.reach_note));
  ProcessNode process(bus, facts, &counter, node->get());
  PublisherWatch publishers(bus, name, (*node)->inboxes());
  BusWatch receipts(bus, name);

  const NodeInfo& info = (*node)->info();
  lines.print(fmt::format("{}: running on {}, configuration {}, budget {} ms; stop with Ctrl-C",
                          name, bus->url(), options.config, milliseconds(info.budget)));
  RunReport report = run({node->get(), &process, &publishers, &receipts}, timeline, &counter);
  report.nodes.resize(1);  // the node's own
  std::string text = report.text();
  if (!text.empty()) text.pop_back();  // the last line end
  lines.print(text);
  if (bus->publish_failures() > 0) {
    lines.print(fmt::format("{}: {} messages could not be sent", name, bus->publish_failures()));
  }
  const Outcome status = bus->status();
  return status ? kExitOk : fail(name, status.error());
}

int parse_and_run(int argc, char** argv, std::string_view name, const NodeFactory& factory,
                  const NodeFactory& for_check) {
  CLI::App app;
  NodeOptions options;
  add_node_options(name, &app, &options);
  if (const auto ended = command_line::parse(&app, argc, argv)) {
    return command_line::print(*ended);
  }
  if (!options.check) return run_live(name, options, factory);
  return check(name, options, for_check ? for_check : factory);
}

}  // namespace

int node_main(int argc, char** argv, std::string_view name, const NodeFactory& factory,
              const NodeFactory& for_check) {
  try {
    return parse_and_run(argc, argv, name, factory, for_check);
  } catch (const std::bad_alloc&) {
    return fail(name, Error{"out of memory"});
  } catch (const std::exception& e) {
    return fail(name, Error{e.what()});
  }
}

}  // namespace rcs
