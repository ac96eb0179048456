// On a private bus (with_bus.sh), on an idle computer: the time from an emergency stop that an
// operator writes to DDS to the first full brake on BG_DRIVE, alone and while another writer floods
// the gateway. RCS_STOP_TRIALS: number of stops, default 200; half of them under the flood.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/bg/live_bg.h"

namespace rcs::gateway {
namespace {

using rcs::test::Program;
using rcs::test::program_path;

constexpr char kConfig[] =
    "[process]\nstate_directory = \"state\"\n[vehicle]\nname = \"demo3\"\n"
    "[gateway]\nunsecured = true\n";
constexpr double kLimit_ms = 150.0;
constexpr double kLongest_ms = 1000.0;

std::unique_ptr<Program> client(std::vector<std::string> args) {
  const std::string profile =
      std::string("file://") + std::getenv("RCS_SOURCE_DIR") + "/config/dds/loopback.xml";
  args.insert(args.begin(), {program_path("dds_client"), "-v", "demo3"});
  return std::make_unique<Program>(args, std::vector<std::string>{"CYCLONEDDS_URI=" + profile});
}

class DdsStopLatency : public bg::test::LiveBg {
 protected:
  DdsStopLatency() : LiveBg(kConfig) {
    gateway_ = std::make_unique<Program>(std::vector<std::string>{program_path("gateway"), config_},
                                         std::vector<std::string>{});
  }

  /// Latencies of `trials` stops [ms].
  std::vector<double> stops(int trials) {
    const auto operator_program = client({"stops", std::to_string(trials)});
    braked_.clear();
    for (int minute = 0; operator_program->status() < 0 && minute < 60; ++minute) {
      (void)run_until([&] { return operator_program->status() >= 0; });
    }
    std::vector<double> latencies_ms;
    const std::string& text = operator_program->output();
    std::size_t k = 0;
    for (std::size_t at = text.find("stop at "); at != std::string::npos;
         at = text.find("stop at ", at + 1), ++k) {
      const Stamp written = from_utime(std::stoll(text.substr(at + 8)));
      const auto first =
          std::find_if(braked_.begin(), braked_.end(), [written](Stamp b) { return b >= written; });
      if (first != braked_.end()) latencies_ms.push_back(milliseconds(*first - written));
    }
    EXPECT_EQ(latencies_ms.size(), static_cast<std::size_t>(trials)) << gateway_->output();
    return latencies_ms;
  }
  static void judge(const char* when, std::vector<double> ms) {
    ASSERT_FALSE(ms.empty());
    std::sort(ms.begin(), ms.end());
    const auto quantile = [&](double q) {
      return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))];
    };
    std::printf("[  STOP    ] %zu stops over DDS, %s: p50 %.1f ms, p99 %.1f ms, max %.1f ms\n",
                ms.size(), when, quantile(0.5), quantile(0.99), ms.back());
    EXPECT_LE(quantile(0.99), kLimit_ms) << when;
    EXPECT_LE(ms.back(), kLongest_ms) << when;
  }

  std::unique_ptr<Program> gateway_;
  std::vector<Stamp> braked_;  // first full brake of each emergency stop
  bool before_ = false;
  Tap<drive_t> brakes_{bus_.get(), channel::kBgDrive, [this](const drive_t& m, Stamp at) {
                         const bool now =
                             m.emergency_stop == 1 && m.brake == 1 && m.speed_mps == 0.0;
                         if (now && !before_) braked_.push_back(at);
                         before_ = now;
                       }};
};

TEST_F(DdsStopLatency, FromTheOperatorToFullBrake) {
  const char* const given = std::getenv("RCS_STOP_TRIALS");      // NOLINT(concurrency-mt-unsafe)
  const int trials = given == nullptr ? 200 : std::atoi(given);  // NOLINT(cert-err34-c)
  ASSERT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << bg_->output();
  judge("idle", stops(trials));
  const auto flood = client({"-o", "mallory", "flood", std::to_string(3 * trials + 30)});
  ASSERT_TRUE(run_until([&] { return gateway_->has_said("command.rejected"); }));
  judge("under a flood", stops(trials / 2));
}

}  // namespace
}  // namespace rcs::gateway
