// rcs replay

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "lcmtypes/channels.h"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_config.h"
#include "modules/wm/wm_node.h"
#include "rcs/command_line/config_files.h"
#include "rcs/node/executor.h"
#include "rcs/node/log/log_source.h"
#include "rcs/node/process/cycle_sinks.h"
#include "rcs/terrain/map_folder.h"
#include "tools/base/files.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/logs/part_of_log.h"
#include "tools/rcs/logs/replay_verdict.h"
#include "tools/rcs/logs/run_reading.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kReplayName = "replay";

class Replay final : public Command {
 public:
  explicit Replay(CLI::App* rcs)
      : Command(rcs->add_subcommand("replay",
                                    "Run SP and WM in lockstep on the sensor data of a log")) {
    app()
        ->add_option("CONFIG", config_, "the vehicle's configuration (TOML)")
        ->required()
        ->transform(command_line::config_file());
    app()
        ->add_option("LOG", log_,
                     "log with sensor channels; its SP_* and WM_* messages are ignored")
        ->required()
        ->check(CLI::ExistingFile);
    app()
        ->add_option("-o,--out", out_, "output log: messages of SP and WM, and SIM_TRUTH")
        ->type_name("FILE")
        ->required();
    add_list(app(), "--without", &without_, "sensor channels to exclude")
        ->check(CLI::IsMember(
            std::vector<std::string>(channel::kSensors.begin(), channel::kSensors.end())));
    add_repeated(app(), "--set", &overrides_,
                 "value (TOML) of a key, instead of that of the configuration")
        ->type_name("TABLE.KEY=VALUE");
    app()
        ->add_option("--from", from_s_, "begin, time after the first sensor event of the log [s]")
        ->check(CLI::Range(0.0, 1e9));
    app()
        ->add_option("--to", to_s_,
                     "end, exclusive, time after the first sensor event of the log [s]")
        ->check(CLI::Range(0.0, 1e9));
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "One thread, driven by the log: the same input gives the same bytes in OUT (compare with\n"
        "sha256sum). Measured computing times go to OUT.timing, which differs between runs.\n"
        "Ctrl-C leaves no partial OUT behind; an existing file stays unchanged.\n"
        "OUT is written, but the exit status is 1 with the reason on stderr, in these cases:\n"
        "no pose; LADAR data without a single registration; an a priori map more than 50 m from\n"
        "the course; a datum more than 10 km from the first fix.\n"
        "Examples:\n"
        "  rcs replay config/kitti.toml kitti.log -o out/kitti.log && sha256sum out/kitti.log\n"
        "  rcs replay config/demo3.toml run.log -o ins.log --without LADAR_RANGES,ODOMETRY\n"
        "INS alone, also without the non-holonomic constraint and zero velocity at standstill:\n"
        "  rcs replay config/demo3.toml run.log -o ins.log --without LADAR_RANGES,ODOMETRY \\\n"
        "      --set odometry.constrained=false --set odometry.zero_velocity=false");
  }

  int run() override {
    const tools::OutputFile out(out_);
    const tools::OutputFile timing(out.in_place() ? "/dev/null" : out_ + ".timing");
    Outcome done = out.check();
    if (done) done = timing.check();
    if (done) done = replay(out.write_path(), timing.write_path());
    if (done) done = timing.commit();
    if (done) done = out.commit();
    if (!done) return fail(kReplayName, done.error());
    const int status = out.in_place() ? report_unread() : summarize_run();
    for (const std::string& fault : faults_) fmt::print(stderr, "rcs replay: {}\n", fault);
    return faults_.empty() ? status : kExitNegative;
  }

 private:
  [[nodiscard]] Outcome replay(const std::string& out_path, const std::string& timing_path) {
    const Result<ParamFile> params = ParamFile::load(config_, overrides_);
    if (!params) return params.error();
    Result<LogReader> reader = LogReader::open(log_);
    if (!reader) return reader.error();
    Result<LogWriter> writer = LogWriter::create(out_path);
    if (!writer) return writer.error();
    const Result<std::unique_ptr<TimingFile>> timing = TimingFile::create(timing_path);
    if (!timing) return timing.error();

    LocalBus bus;
    LogRecorder recorder(&writer.value(), {channel::kSensors.begin(), channel::kSensors.end()});
    ReplayVerdict verdict(&recorder);
    bus.set_tap(&verdict);
    const std::int64_t run_id = run_id_of(reader->path());
    bus.set_publisher({run_id, id_of("sp")});
    const Result<std::unique_ptr<Node>> sp = sp::make_sp_node(*params, &bus);
    if (!sp) return sp.error();
    bus.set_publisher({run_id, id_of("wm")});
    const Result<std::unique_ptr<Node>> wm = wm::make_wm_node(*params, &bus);
    if (!wm) return wm.error();

    LogSource whole(&reader.value(), fed_channels());
    RunReport report;
    {
      PartOfLog source(kReplayName, &whole, from_seconds(from_s_), to(), &reader.value());
      LockstepTimeline timeline(&bus, &source, kReplayTail);
      report = rcs::run({sp->get(), wm->get()}, timeline, timing->get());
      if (source.interrupted()) return Error{"interrupted"};
    }
    if (!reader->health().good()) {
      fmt::print(stderr, "rcs replay: {}: {}\n", log_, reader->health().summary());
    }
    if (whole.clock_jumps() > 0) {
      fmt::print(stderr, "rcs replay: {}: the log's clock jumps {} times\n", log_,
                 whole.clock_jumps());
    }
    if (verdict.sensor_messages() == 0) {
      return Error{log_ +
                   ": no sensor message in the requested interval and on the requested channels"};
    }
    fmt::print(stderr, "{}", report.text());
    if (Outcome closed = (*timing)->close(); !closed) return closed;
    if (Outcome closed = writer->close(); !closed) return closed;
    return judge(*params, verdict);
  }

  /// Hash of the configuration, its overrides, and the size and the beginning of the log.
  [[nodiscard]] std::int64_t run_id_of(const std::string& log) const {
    constexpr std::streamsize kBeginning = 65536;
    std::string beginning(kBeginning, '\0');
    std::ifstream file(log, std::ios::binary | std::ios::ate);
    std::string text = std::to_string(file.tellg());
    file.seekg(0);
    file.read(beginning.data(), kBeginning);
    text.append(beginning, 0, static_cast<std::size_t>(file.gcount()));
    if (const Result<std::string> config = tools::read_text(config_)) text += *config;
    for (const std::string& line : overrides_) text += "\n" + line;
    for (const std::string& channel : without_) text += "\n" + channel;
    return id_of(text);
  }

  /// Adds to `faults_` the parts of the configuration that the replay did not use.
  [[nodiscard]] Outcome judge(const ParamFile& params, const ReplayVerdict& verdict) {
    const Result<wm::WmConfig> config = wm::load_wm_config(params);
    if (!config) return config.error();
    const std::string& path = config->prior_terrain.map;
    std::optional<MapFolder> map;
    if (!path.empty()) {
      Result<MapFolder> opened = MapFolder::open(path);
      if (!opened) return opened.error();
      map.emplace(std::move(opened).value());
    }
    faults_ = verdict.faults(config->datum, map ? &map->index() : nullptr);
    return Done{};
  }

  [[nodiscard]] Duration to() const { return to_s_ < 1e12 ? from_seconds(to_s_) : Duration::max(); }

  [[nodiscard]] std::vector<std::string> fed_channels() const {
    std::vector<std::string> fed = {channel::kSimTruth};
    for (const char* sensor : channel::kSensors) {
      if (std::find(without_.begin(), without_.end(), sensor) == without_.end()) {
        fed.emplace_back(sensor);
      }
    }
    return fed;
  }

  /// The metrics are those of the log, and a device cannot be read back.
  [[nodiscard]] int report_unread() const {
    if (json_) {
      const report::Json json = {{"log", out_}, {"faults", faults_}, {"metrics", nullptr}};
      fmt::print("{}", report::json_document(kReplayName, json));
    }
    return kExitOk;
  }

  [[nodiscard]] int summarize_run() const {
    const Result<recording::RunLog> run = read_run(kReplayName, out_);
    if (!run) return fail(kReplayName, run.error());
    const evaluation::RunMetrics metrics = evaluation::run_metrics(*run);
    if (json_) {
      const report::Json json = {{"log", out_}, {"faults", faults_}, {"metrics", to_json(metrics)}};
      fmt::print("{}", report::json_document(kReplayName, json));
    } else {
      fmt::print(stderr, "\n{}\n{}", to_text(evaluation::scan_table(metrics)),
                 to_text(evaluation::latency_table(metrics)));
    }
    return kExitOk;
  }

  std::string config_;
  std::string log_;
  std::string out_;
  std::vector<std::string> without_;
  std::vector<std::string> overrides_;
  std::vector<std::string> faults_;
  double from_s_ = 0.0;
  double to_s_ = std::numeric_limits<double>::infinity();
  bool json_ = false;
};

}  // namespace

void add_replay_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Replay>(rcs));
}

}  // namespace rcs::cli
