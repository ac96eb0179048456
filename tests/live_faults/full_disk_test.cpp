// The disk of a driving vehicle is full: its folder with configuration, state, recording and the
// output of all processes. It drives on and reports it; an emergency stop is in force, is reported
// as not persisted, and survives kill -9 of a node or of `rcs up` while its superior repeats it; it
// is persisted when there is room. A release needs no room. RCS_DRILL_TIMES: repetitions,
// default 5.

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "lcmtypes/events.h"
#include "tests/live_faults/live_fault.h"
#include "tests/live_faults/redirected_programs.h"
#include "tests/support/fresh_folder.h"

namespace rcs::live_faults {
namespace {

namespace fs = std::filesystem;

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kProgram = from_seconds(30.0);
constexpr Duration kDrives = from_seconds(5.0);
constexpr Duration kBrakeWithin = from_seconds(1.0);
constexpr Duration kPersistedWithin = from_seconds(3.0);  // BG tries again every second
constexpr double kRest_mps = 0.02;
constexpr double kMoved_m = 0.1;
constexpr char kSize[] = "size=48m";

/// A small disk that only this process and its children see.
class SmallDisk {
 public:
  SmallDisk() : folder_(rcs::test::fresh_folder() / "disk") {
    fs::create_directories(folder_);
    mounted_ = unshare(CLONE_NEWNS) == 0 &&
               mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               mount("none", folder_.c_str(), "tmpfs", 0, kSize) == 0;
    if (mounted_) (void)setenv("TMPDIR", folder_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    (void)unsetenv("TMPDIR");  // NOLINT(concurrency-mt-unsafe): one thread
    if (mounted_) (void)umount2(folder_.c_str(), MNT_DETACH);
  }

  [[nodiscard]] bool mounted() const { return mounted_; }
  [[nodiscard]] const fs::path& folder() const { return folder_; }
  /// Until not a byte is left.
  void fill() const {
    const FileHandle file(
        ::open(filler().c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    const std::array<char, 65536> zeros{};
    for (std::size_t size = zeros.size(); size > 0;) {
      if (write(file.get(), zeros.data(), size) <= 0) size /= 2;
    }
  }
  void make_room() const { fs::remove(filler()); }
  [[nodiscard]] bool full() const { return fs::space(folder_).available == 0; }

 private:
  [[nodiscard]] fs::path filler() const { return folder_ / "filler"; }

  fs::path folder_;
  bool mounted_ = false;
};

/// A vehicle on the disk.
class OnDisk {
 public:
  explicit OnDisk(const SmallDisk* disk) : disk_(disk) {
    Bus* const bus = live.run.bus();
    if (bus == nullptr) return;
    drives_.emplace(bus, channel::kBgDrive, [this](const drive_t& m, Stamp at) {
      brakes = m.brake == 1 && m.emergency_stop == 1 && m.speed_mps == 0.0;
      if (brakes && !braked) braked = at;
      if (latched && !brakes) ++unbraked;
    });
    stops_.emplace(bus, channel::kBgStop, [this](const command_t&, Stamp at) {
      if (!sent) sent = at;
    });
    statuses_.emplace(bus, channel::kBgStatus, [this](const status_t& m, Stamp) { status = m; });
    truths_.emplace(bus, channel::kSimTruth, [this](const truth_t& m, Stamp) { take(m); });
    const auto receive = [this](const event_t& m, Stamp) { codes.insert(m.code); };
    bg_events_.emplace(bus, channel::kBgEvent, receive);
    record_events_.emplace(bus, channel::kRecordEvent, receive);
  }

  bool until(Duration most, const std::function<bool()>& enough) {
    return live.run.run_until(live.run.now() + most, enough);
  }
  /// The recorder makes room as long as it has old segments.
  bool until_full(Duration most) {
    return until(most, [this] {
      disk_->fill();
      return codes.count(event::kRecordStopped.code) == 1 && disk_->full();
    });
  }
  void watch_stop() {
    sent.reset();
    braked.reset();
    rest_world_.reset();
    moved_m = 0.0;
    unbraked = 0;
  }
  std::string why() {
    std::string text = live.recovery.missing() + "; " + live.run.trouble() + "; BG " +
                       status.state + ": " + status.reason + "\n";
    for (const std::string& e : live.events) text += "  " + e + "\n";
    return text;
  }

  LiveFault live;
  status_t status{};
  bool brakes = false;
  bool latched = false;       ///< by a stop that BG has echoed
  std::optional<Stamp> sent;  ///< the stop
  std::optional<Stamp> braked;
  int unbraked = 0;
  double moved_m = 0.0;  ///< after the vehicle has come to rest
  std::set<std::string> codes;

 private:
  void take(const truth_t& m) {
    const Vec2 here(m.p_world_vehicle_m[0], m.p_world_vehicle_m[1]);
    const bool rest = std::hypot(m.v_world_mps[0], m.v_world_mps[1]) < kRest_mps;
    if (braked && !rest_world_ && rest) rest_world_ = here;
    if (rest_world_) moved_m = std::max(moved_m, (here - *rest_world_).norm());
  }

  const SmallDisk* disk_;
  std::optional<Vec2> rest_world_;
  std::optional<Tap<drive_t>> drives_;
  std::optional<Tap<command_t>> stops_;
  std::optional<Tap<status_t>> statuses_;
  std::optional<Tap<truth_t>> truths_;
  std::optional<Tap<event_t>> bg_events_, record_events_;
};

class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    if (!disk_.mounted()) GTEST_SKIP() << "NOT TESTED: this system does not allow a private mount";
    programs_ = std::make_unique<RedirectedPrograms>(disk_.folder().parent_path() / "bin");
    for (const char* p : {"sp", "wm", "bg", "gateway", "up"}) {
      programs_->redirect(p, disk_.folder() / "output.txt");
    }
    vehicle_ = std::make_unique<OnDisk>(&disk_);
    ASSERT_EQ(vehicle_->live.run.trouble(), "");
    Result<cli::ChildProcess> recorder = start({"record", (disk_.folder() / "recording").string(),
                                                "--reserve-mb", "1", "--segment-mb", "2"});
    ASSERT_TRUE(recorder.ok());
    recorder_.emplace(std::move(recorder).value());
    ASSERT_TRUE(vehicle_->live.run_until_well(kPatience)) << vehicle_->why();
  }
  void TearDown() override {
    vehicle_.reset();  // before its disk
    if (recorder_) recorder_->send_signal(SIGKILL);
  }

  static Result<cli::ChildProcess> start(const std::vector<std::string>& arguments) {
    const char* const bin = std::getenv("RCS_BIN_DIR");  // NOLINT(concurrency-mt-unsafe)
    return cli::ChildProcess::start(std::string(bin) + "/rcs", arguments);
  }
  void expect_well(const std::string& when) {
    vehicle_->live.recovery.reset();
    EXPECT_TRUE(vehicle_->live.run_until_well(kPatience)) << when << ": " << vehicle_->why();
  }

  /// It is rejected until WM has a valid pose again.
  bool release() {
    VehicleRun& run = vehicle_->live.run;
    const Stamp until = run.now() + kPatience;
    int status = -1;
    while (status != 0 && run.now() < until && run.trouble().empty()) {
      status = run.run_program("rcs", {"go", "--release", "--timeout", "20"}, kProgram);
    }
    return status == 0;
  }

  SmallDisk disk_;
  std::unique_ptr<RedirectedPrograms> programs_;
  std::unique_ptr<OnDisk> vehicle_;
  std::optional<cli::ChildProcess> recorder_;
};

TEST_F(FullDisk, AStopIsInForceAndReportedAndPersistedLater) {
  const int times = number_from("RCS_DRILL_TIMES", 5);
  OnDisk& v = *vehicle_;
  Duration slowest{};
  Duration persisted{};
  double moved_m = 0.0;
  for (int k = 0; k < times && !HasFailure(); ++k) {
    const std::string killed =
        k % 5 == 4 ? "up"
                   : std::vector<std::string>{"bg", "wm", "sp",
                                              "gateway"}[static_cast<std::size_t>(k % 5)];
    // Each time the recorder has continued with the room of the time before.
    for (const event::Info* e : {&event::kRecordStopped, &event::kBgStopNotPersisted}) {
      v.codes.erase(e->code);
    }
    ASSERT_TRUE(v.until_full(kPatience)) << "the recorder does not report the full disk";
    EXPECT_EQ(v.codes.count(event::kRecordShed.code), 1U);
    expect_well("with a full disk");
    v.live.run_for(kDrives);
    disk_.fill();
    v.watch_stop();
    Result<cli::ChildProcess> superior = start({"go", "--emergency-stop"});
    ASSERT_TRUE(superior.ok());
    ASSERT_TRUE(v.until(kPatience, [&] { return v.sent && v.braked; })) << v.why();
    slowest = std::max(slowest, *v.braked - *v.sent);
    v.latched = true;
    EXPECT_TRUE(v.until(kPatience, [&] { return v.live.safety.speed_mps() < kRest_mps; }));
    v.live.run_for(from_seconds(2.5));
    EXPECT_TRUE(disk_.full());
    EXPECT_EQ(v.status.emergency_stop, +status_t::STOP_LATCHED);
    EXPECT_EQ(v.codes.count(event::kBgStopNotPersisted.code), 1U);
    EXPECT_NE(v.status.reason.find("not persisted"), std::string::npos) << v.status.reason;
    EXPECT_FALSE(superior->collect()) << "the stop is not confirmed";
    // The superior sends it again to the successor of BG.
    v.latched = killed != "bg" && killed != "up";
    const int pid = v.live.run.pid_of(killed == "up" ? "bg" : killed);
    if (killed == "up") {
      v.live.run.restart_up();
    } else {
      v.live.run.send_signal(killed, SIGKILL);
    }
    const auto back = [&] { return v.live.run.pid_of(killed == "up" ? "bg" : killed) != pid; };
    EXPECT_TRUE(v.until(kPatience, back)) << killed << " is not back: " << v.why();
    EXPECT_TRUE(v.until(kPatience, [&] { return v.brakes && !v.status.stop.empty(); })) << v.why();
    v.latched = true;
    v.live.run_for(from_seconds(3.0));
    EXPECT_EQ(v.status.emergency_stop, +status_t::STOP_LATCHED) << "after kill -9 of " << killed;
    const Stamp room = v.live.run.now();
    disk_.make_room();
    EXPECT_TRUE(v.until(kPersistedWithin + from_seconds(5.0), [&] {
      return v.status.emergency_stop == status_t::STOP_PERSISTED;
    })) << v.why();
    persisted = std::max(persisted, v.live.run.now() - room);
    std::optional<cli::Exit> ended;
    EXPECT_TRUE(v.until(kPatience, [&] { return (ended = superior->collect()).has_value(); }));
    EXPECT_EQ(ended.value_or(cli::Exit{}).code, 0);
    EXPECT_EQ(v.unbraked, 0) << "after kill -9 of " << killed;
    moved_m = std::max(moved_m, v.moved_m);
    // Removing the file of the latch needs no room.
    disk_.fill();
    v.latched = false;
    EXPECT_TRUE(release()) << v.why();
    expect_well("after the release, killed: " + killed);
    disk_.make_room();
    v.live.run_for(kDrives);
  }
  std::printf(
      "%d times: full brake after at most %.0f ms, moved by at most %.3f m before the release, "
      "persisted at most %.1f s after there was room\n",
      times, milliseconds(slowest), moved_m, seconds(persisted));
  EXPECT_LT(slowest, kBrakeWithin);
  EXPECT_LT(moved_m, kMoved_m);
  EXPECT_LE(persisted, kPersistedWithin);
  EXPECT_EQ(v.live.safety.metrics().collisions, 0);
  EXPECT_EQ(v.live.run.trouble(), "");
}

}  // namespace
}  // namespace rcs::live_faults
