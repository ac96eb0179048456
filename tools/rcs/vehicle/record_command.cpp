// rcs record

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <exception>

#include "rcs/node/bus/bus_options.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/process/terminal_line.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/rcs/command.h"

#include "tools/recorder/audit_trail.h"
#include "tools/recorder/disk_folder.h"
#include "tools/recorder/recorder_report.h"
#include "tools/recorder/recorder_thread.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

using recorder::RecorderThread;

constexpr std::string_view kRecordName = "record";
constexpr std::string_view kPrefix = "rcs record: ";
/// Messages that wait for the disk: more than half a minute of a vehicle with a LADAR.
constexpr std::size_t kMaxWaitingBytes = std::size_t{64} << 20;
/// Messages that are received after the end was requested: those that wait in LCM.
constexpr int kMaxLastMessages = 20'000;

double megabytes(std::int64_t bytes) { return static_cast<double>(bytes) * 1e-6; }
std::int64_t from_megabytes(double mb) { return static_cast<std::int64_t>(mb * 1e6); }

/// On a terminal one line that is replaced; elsewhere nothing. A blocked terminal is left out.
class StatusLine {
 public:
  void show(std::string_view text) { shown_ = write(fmt::format("\r\033[K{}", text)); }
  void erase() {
    if (shown_) (void)write("\r\033[K");
    shown_ = false;
  }

 private:
  static bool write(const std::string& text) {
    return isatty(STDERR_FILENO) == 1 && write_without_waiting(text);
  }
  bool shown_ = false;
};

/// Passes every message of the bus to the queue, and its audit lines.
class Tap final : public BusMonitor {
 public:
  explicit Tap(recorder::RecordQueue* queue) : queue_(queue) {}

  void receive(std::string_view channel, const std::uint8_t* data, std::size_t size,
               std::int64_t received_utime) noexcept override {
    const Stamp wall = from_utime(received_utime);
    queue_->push_message(wall, channel, data, size);
    try {
      for (const std::string& line : trail_.on_message(wall, channel, data, size)) {
        queue_->push_audit_line(wall, line);
      }
    } catch (const std::exception&) {
      queue_->count_lost_audit_line();  // out of memory
    }
  }

 private:
  recorder::RecordQueue* queue_;
  recorder::AuditTrail trail_;
};

class Record final : public Command {
 public:
  explicit Record(CLI::App* rcs)
      : Command(rcs->add_subcommand("record", "Record all channels of the bus to a folder")) {
    app()
        ->add_option("FOLDER", folder_, "folder of the recording; created if missing")
        ->type_name("FOLDER")
        ->required();
    add_megabytes("--size-mb", &size_mb_, "limit of all segments [MB]; the oldest are deleted",
                  1.0);
    add_megabytes("--segment-mb", &segment_mb_,
                  "size of a segment [MB]; at most a quarter of "
                  "--size-mb",
                  0.1);
    app()
        ->add_option("--segment-s", segment_s_, "duration of a segment [s]")
        ->check(CLI::Range(1.0, 1e6))
        ->capture_default_str();
    add_megabytes("--reserve-mb", &reserve_mb_, "free space that is left on the disk [MB]", 0.0);
    add_megabytes("--audit-mb", &audit_mb_, "limit of the audit log [MB]", 0.1);
    app()
        ->add_option("--duration", duration_s_, "end after this time [s]; default: Ctrl-C")
        ->check(CLI::Range(0.0, 1e9));
    add_bus_option(app(), &lcm_url_);
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The recording is a ring of LCM event logs, FOLDER/rcs-NUMBER-TIME.log, in the order of\n"
        "their numbers; also those of former runs, which are deleted first. `rcs log` reads the\n"
        "folder as one log. Everything received is on the disk less than a second later. If the\n"
        "disk is full, or has less than the reserve, the oldest segments are deleted; if nothing\n"
        "is left to delete, the recording stops until there is space. This is reported here and "
        "as\n"
        "RECORD_EVENT. FOLDER/audit-NUMBER-TIME.jsonl has commands, stops, the events of "
        "operators\n"
        "and refusals, one JSON object in a line; messages do not displace it.\n"
        "Ctrl-C or SIGTERM ends the recording (status 0). Exit status 1 if messages are missing "
        "in\n"
        "it. Nothing is published but RECORD_PROCESS and RECORD_EVENT.\n"
        "Examples:\n"
        "  rcs record recording/\n"
        "  rcs record /data/recording --size-mb 20000 --reserve-mb 1000\n"
        "  rcs log cut recording/ --around solution.lost -o lost.log");
  }

  int run() override;

 private:
  void add_megabytes(const std::string& name, double* value, const std::string& text, double min) {
    app()->add_option(name, *value, text)->check(CLI::Range(min, 1e8))->capture_default_str();
  }
  [[nodiscard]] recorder::RecorderParams params() const;
  [[nodiscard]] Outcome record(recorder::Recorder* recorder);
  void receive(LiveTimeline* timeline, Bus* bus, RecorderThread* thread);
  void show(const RecorderThread::State& state);
  [[nodiscard]] int print_result(const RecorderThread::State& state) const;

  std::string folder_;
  std::string lcm_url_;
  double size_mb_ = 4096.0;
  double segment_mb_ = 64.0;
  double segment_s_ = 60.0;
  double reserve_mb_ = 256.0;
  double audit_mb_ = 64.0;
  double duration_s_ = -1.0;
  bool json_ = false;

  TerminalLines console_;
  StatusLine status_;
  RecorderThread::State result_;
};

recorder::RecorderParams Record::params() const {
  recorder::RecorderParams p;
  p.messages.max_bytes = from_megabytes(size_mb_);
  p.messages.segment_bytes = from_megabytes(std::min(segment_mb_, size_mb_ / 4.0));
  p.messages.segment_duration = from_seconds(segment_s_);
  p.audit.max_bytes = from_megabytes(audit_mb_);
  p.audit.segment_bytes = from_megabytes(audit_mb_ / 8.0);
  p.reserve_bytes = from_megabytes(reserve_mb_);
  return p;
}

int Record::run() {
  Result<std::unique_ptr<recorder::DiskFolder>> folder = recorder::DiskFolder::open(folder_);
  if (!folder) return fail(kRecordName, folder.error());
  recorder::Recorder recorder(folder->get(), params());
  if (const int error = recorder.open(); error != 0) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread yet
    return fail(kRecordName, Error{fmt::format("{}: {}", folder_, std::strerror(error))});
  }
  const Outcome done = record(&recorder);
  if (!done) return fail(kRecordName, done.error());
  return print_result(result_);
}

Outcome Record::record(recorder::Recorder* recorder) {
  const StopSignals stop;  // before the threads, which inherit the mask
  Result<std::unique_ptr<LcmBus>> opened = LcmBus::create(lcm_url_);
  if (!opened) return opened.error();
  LcmBus& bus = **opened;
  LiveTimeline timeline(&bus, &stop);
  RecorderThread thread(recorder, kMaxWaitingBytes, [&timeline] { return timeline.now(); });
  thread.queue().push_audit_line(
      from_utime(wall_utime()),
      recorder::AuditTrail::begin_line(from_utime(wall_utime()), bus.url()));
  Tap tap(&thread.queue());
  bus.subscribe_all(&tap);
  if (Outcome status = bus.status(); !status) return status;
  console_.print(
      kPrefix, fmt::format("recording all channels of {} to {}, at most {:.0f} MB; Ctrl-C ends it",
                           bus.url(), folder_, size_mb_));
  receive(&timeline, &bus, &thread);
  status_.erase();
  for (int i = 0; i < kMaxLastMessages && bus.deliver_one(timeline.now()); ++i) {
  }
  const Stamp end = from_utime(wall_utime());
  thread.queue().push_audit_line(end, recorder::AuditTrail::end_line(end));
  thread.stop();
  result_ = thread.state();
  return bus.status();
}

void Record::receive(LiveTimeline* timeline, Bus* bus, RecorderThread* thread) {
  recorder::RecorderReport report(bus, params(), folder_, timeline->now());
  const Stamp end = duration_s_ < 0.0 ? Stamp::max() : timeline->now() + from_seconds(duration_s_);
  for (;;) {
    const Timeline::Step step = timeline->advance(std::min(report.next(), end));
    if (step == Timeline::Step::kEnded) return;
    const Stamp now = timeline->now();
    if (now >= report.next()) {
      const RecorderThread::State state = thread->state();
      const std::vector<std::string> texts = report.update(now, state);
      if (!texts.empty()) status_.erase();
      for (const std::string& text : texts) console_.print(kPrefix, text);
      show(state);
    }
    if (now >= end) return;
  }
}

void Record::show(const RecorderThread::State& state) {
  status_.show(fmt::format("{} messages, {:.1f} MB recorded; {} segments, {:.1f} MB{}",
                           state.recorder.messages, megabytes(state.recorder.bytes),
                           state.recorder.segments, megabytes(state.recorder.segment_bytes),
                           state.recorder.stopped_by != 0 ? "; STOPPED" : ""));
}

int Record::print_result(const RecorderThread::State& state) const {
  const recorder::RecorderStatus& r = state.recorder;
  const std::int64_t missing = r.messages_lost + state.queue.dropped + state.queue.rejected;
  if (json_) {
    fmt::print("{}", report::json_document(
                         kRecordName, {{"folder", folder_},
                                       {"messages", r.messages},
                                       {"bytes", r.bytes},
                                       {"messages_lost", r.messages_lost},
                                       {"messages_dropped", state.queue.dropped},
                                       {"messages_rejected", state.queue.rejected},
                                       {"audit_lines", r.audit_lines},
                                       {"audit_lines_lost",
                                        r.audit_lines_lost + state.queue.audit_lines_dropped},
                                       {"segments", r.segments},
                                       {"segment_bytes", r.segment_bytes},
                                       {"segments_deleted", r.shed_by_limit + r.shed_for_space}}));
  } else {
    TerminalLines().print(
        kPrefix, fmt::format("{}: {} messages, {:.1f} MB recorded, {} missing; {} segments, "
                             "{:.1f} MB in the folder; {} audit lines",
                             folder_, r.messages, megabytes(r.bytes), missing, r.segments,
                             megabytes(r.segment_bytes), r.audit_lines));
  }
  return missing == 0 ? kExitOk : kExitNegative;
}

}  // namespace

void add_record_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Record>(rcs));
}

}  // namespace rcs::cli
