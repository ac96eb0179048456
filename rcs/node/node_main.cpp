#include "rcs/node/node_main.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <utility>

#include "rcs/node/cycle_sinks.h"
#include "rcs/node/executor.h"
#include "rcs/node/lcm_bus.h"
#include "rcs/node/live_timeline.h"
#include "rcs/node/report.h"

namespace rcs {
namespace {

int fail(std::string_view name, const Error& error) {
  fmt::print(stderr, "{}: {}\n", name, error.message);
  return 1;
}

int run_live(std::string_view name, const std::string& config, const std::string& url,
             const NodeFactory& factory) {
  const Result<ParamFile> params = ParamFile::load(config);
  if (!params) return fail(name, params.error());

  const StopSignals stop;
  const Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(url);
  if (!opened) return fail(name, opened.error());
  LcmBus* const bus = opened->get();
  EventPrinter printer(bus, name);  // before the node, which may report while it starts
  const Result<std::unique_ptr<Node>> node = factory(*params, bus);
  if (!node) return fail(name, node.error());
  if (const Outcome status = bus->status(); !status) return fail(name, status.error());

  const NodeInfo& info = (*node)->info();
  fmt::print(stderr, "{}: running on {}, configuration {}, budget {} ms; stop with Ctrl-C\n", name,
             bus->url(), config, milliseconds(info.budget));
  LiveTimeline timeline(bus, &stop);
  CyclePublisher cycles(bus);
  const RunReport report = run({node->get()}, timeline, &cycles);
  fmt::print(stderr, "{}", report.text());
  if (bus->publish_failures() > 0) {
    fmt::print(stderr, "{}: {} messages could not be sent\n", name, bus->publish_failures());
  }
  const Outcome status = bus->status();
  return status ? 0 : fail(name, status.error());
}

}  // namespace

int node_main(int argc, char** argv, std::string_view name, const NodeFactory& factory) {
  CLI::App app(fmt::format("RCS node {}: runs on the LCM bus until Ctrl-C or SIGTERM", name),
               std::string(name));
  std::string config;
  std::string url;
  app.add_option("CONFIG", config, "the vehicle's configuration (TOML)")->required();
  app.add_option("--lcm-url", url,
                 fmt::format("the bus; default: $LCM_DEFAULT_URL, else {}", kDefaultLcmUrl));
  app.footer(fmt::format("Example:\n  {} config/demo3.toml", name));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  return run_live(name, config, url, factory);
}

}  // namespace rcs
