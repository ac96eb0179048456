// rcs log mcap

#include <fmt/format.h>

#include <algorithm>

#include "modules/sp/sp_config.h"
#include "rcs/command_line/config_files.h"
#include "rcs/node/params/params.h"
#include "rcs/ros2/clock_estimate.h"
#include "tools/base/files.h"
#include "tools/mcap/log_export.h"
#include "tools/mcap/mcap_file.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/logs/log_events.h"
#include "tools/rcs/logs/mcap_commands.h"
#include "tools/recording/message_fields.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kMcapName = "log mcap";

class LogMcap final : public Command {
 public:
  explicit LogMcap(CLI::App* log)
      : Command(log->add_subcommand("mcap", "Export a log as MCAP with messages of ROS 2")) {
    add_log_option(app(), &log_);
    app()
        ->add_option("-o,--out", out_, "output file, e.g. run.mcap")
        ->type_name("FILE")
        ->required();
    app()
        ->add_option("--config", config_,
                     "configuration of the vehicle: the calibration makes points of LADAR_RANGES,\n"
                     "and the mount of the LADAR is included in /tf")
        ->transform(command_line::config_file());
    app()
        ->add_option("--types", types_,
                     "ros: standard types of ROS 2, for viewers; rcs: each channel under its own\n"
                     "type, without loss; both: both of them")
        ->capture_default_str()
        ->check(CLI::IsMember({"both", "ros", "rcs"}));
    add_list(app(), "--channel", &channels_, "only these channels")->type_name("CHANNEL");
    app()
        ->add_option("--compression", compression_, "compression of the chunks")
        ->capture_default_str()
        ->check(CLI::IsMember({"zstd", "none"}));
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "Foxglove, Lichtblick, PlotJuggler, Rerun and `ros2 bag` open the file; no ROS 2 is\n"
        "needed to write it. docs/user/other_tools.md has the table of topics, types and frames.\n"
        "`rcs import mcap` makes a log of it again (--types both or rcs). The same log gives the\n"
        "same bytes. Channels that are not of this system are not included. Exit status 1 if the\n"
        "log has no message of this system. Ctrl-C leaves no partial file behind.\n"
        "Examples:\n"
        "  rcs log mcap run.log -o run.mcap --config config/demo3.toml\n"
        "  rcs log mcap recording/ -o run.mcap --types ros --channel WM_NAV_STATE,GPS_FIX");
  }

  int run() override {
    mcap::ExportOptions options;
    options.standard = types_ != "rcs";
    options.original = types_ != "ros";
    options.writer.profile = "ros2";
    options.writer.library = "rcs " RCS_VERSION;
    options.writer.compression =
        compression_ == "zstd" ? mcap::Compression::kZstd : mcap::Compression::kNone;
    if (Outcome read = read_config(&options); !read) return fail(kMcapName, read.error());

    const tools::OutputFile out(out_);
    if (Outcome checked = out.check(); !checked) return fail(kMcapName, checked.error());
    const Result<ros2::ClockOffsets> clocks = clock_offsets();
    if (!clocks) return fail(kMcapName, clocks.error());
    options.clocks = *clocks;
    return export_to(out, options);
  }

 private:
  Outcome read_config(mcap::ExportOptions* options) const {
    if (config_.empty()) return Done{};
    const Result<ParamFile> file = ParamFile::load(config_);
    if (!file) return file.error();
    const Result<sp::SpConfig> config = sp::load_sp_config(*file);
    if (!config) return config.error();
    options->ladar = config->ladar;
    return Done{};
  }

  /// Reads the log until both clocks are known, or to its end.
  [[nodiscard]] Result<ros2::ClockOffsets> clock_offsets() const {
    Result<recording::LogSeries> log = recording::LogSeries::open(log_);
    if (!log) return log.error();
    ros2::ClockEstimate clocks;
    const InterruptGuard interrupt;
    LogEvent event;
    while (!clocks.complete() && log->next(&event)) {
      if (interrupt.requested()) return Error{"interrupted"};
      const auto head = recording::read_head(event.channel, event.data);
      if (head) clocks.add(event.channel, head->utime, event.stamp);
    }
    return clocks.offsets();
  }

  int export_to(const tools::OutputFile& out, const mcap::ExportOptions& options) {
    Result<std::unique_ptr<mcap::FileSink>> file =
        mcap::FileSink::create(out.write_path(), out.path());
    if (!file) return fail(kMcapName, file.error());
    mcap::LogExport log(options, file->get());
    Outcome written = Done{};
    const int status = for_each_event(kMcapName, log_, [&](const LogEvent& event) {
      const bool wanted = channels_.empty() || std::find(channels_.begin(), channels_.end(),
                                                         event.channel) != channels_.end();
      if (wanted) written = log.add(event);
      return written.ok();
    });
    if (status != kExitOk) return status;
    if (written) written = log.finish();
    if (written) written = (*file)->close();
    if (written && log.messages() == 0) {
      report_result(log, options.clocks);
      return negative(kMcapName, {log_ + ": no message of this system in the selected channels"});
    }
    if (written) written = out.commit();
    if (!written) return fail(kMcapName, written.error());
    report_result(log, options.clocks);
    return kExitOk;
  }

  void report_result(const mcap::LogExport& log, const ros2::ClockOffsets& clocks) const {
    const mcap::ExportCounts& counts = log.counts();
    const std::vector<mcap::ExportedTopic> topics = log.topics();
    if (json_) {
      const bool kept = log.messages() > 0;
      report::Json json = {{"mcap", kept ? report::Json(out_) : report::Json()},
                           {"bytes", kept ? log.bytes() : 0},
                           {"events", counts.events},
                           {"messages", log.messages()},
                           {"malformed", report::Json::object()},
                           {"ranges_without_calibration", counts.ranges_without_calibration},
                           {"unknown_channels", report::Json::object()},
                           {"utc_minus_sensor_time_us", clocks.sensor_us},
                           {"utc_minus_node_time_us", clocks.node_us},
                           {"topics", report::Json::array()}};
      for (const auto& [channel, n] : counts.malformed) json["malformed"][channel] = n;
      for (const auto& [channel, n] : counts.unknown) json["unknown_channels"][channel] = n;
      for (const mcap::ExportedTopic& t : topics) {
        json["topics"].push_back({{"topic", t.topic}, {"type", t.type}, {"messages", t.messages}});
      }
      fmt::print("{}", report::json_document(kMcapName, json));
      return;
    }
    if (log.messages() > 0) {
      fmt::print(stderr, "{}: {:.1f} MB, {} messages on {} topics\n", out_,
                 static_cast<double>(log.bytes()) * 1e-6, log.messages(), topics.size());
    }
    for (const mcap::ExportedTopic& t : topics) {
      fmt::print(stderr, "  {:<28} {:<44} {:>9}\n", t.topic, t.type, t.messages);
    }
    for (const auto& [channel, n] : counts.unknown) {
      fmt::print(stderr, "not included: {} ({} events), not a channel of this system\n", channel,
                 n);
    }
    for (const auto& [channel, n] : counts.malformed) {
      fmt::print(stderr, "not included: {} ({} messages), not of the type of the channel\n",
                 channel, n);
    }
    if (counts.ranges_without_calibration > 0) {
      fmt::print(stderr, "LADAR_RANGES without points: they need the calibration, --config FILE\n");
    }
  }

  std::string log_;
  std::string out_;
  std::string config_;
  std::string types_ = "both";
  std::string compression_ = "zstd";
  std::vector<std::string> channels_;
  bool json_ = false;
};

}  // namespace

void add_log_mcap_command(CLI::App* log, Commands* commands) {
  commands->push_back(std::make_unique<LogMcap>(log));
}

}  // namespace rcs::cli
