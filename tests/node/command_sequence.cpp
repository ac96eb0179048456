#include "tests/node/command_sequence.h"

#include <memory>

namespace rcs::test {

/// hold.
void run_sequence(unsigned seed, int steps) {
  Network network(seed);
  network.flaws = {0.3 * network.below(3), 0.2 * network.below(3), network.below(7)};
  Stamp now(std::chrono::seconds(1000 + network.below(1000)));
  Truth truth;
  auto worker = std::make_unique<Worker>(&network, &now);
  std::unique_ptr<Superior> superiors[2];
  const char* const names[2] = {"operator", "gateway"};
  for (int k = 0; k < 2; ++k) {
    superiors[k] = std::make_unique<Superior>(&network, &now, names[k]);
  }
  int worker_down = 0;                    // steps left
  int superior_down[2] = {0, 0};          // the same
  Stamp last_valid_until = Stamp::min();  // of all commands ever sent
  Stamp worker_received = now;            // latest time at which a status could have been sent

  for (int step = 0; step < steps; ++step, now += kStep) {
    network.deliver(now, [&](const std::string& channel, const std::vector<std::uint8_t>& data) {
      if (worker) worker->door.receive(channel, data);
      for (const auto& s : superiors) {
        if (s) s->door.receive(channel, data);
      }
    });
    if (worker && network.chance(0.02)) {
      worker.reset();
      truth.moving = false;
      worker_down = network.below(25);
    } else if (!worker && worker_down-- <= 0) {
      worker = std::make_unique<Worker>(&network, &now);
    }
    for (int k = 0; k < 2; ++k) {
      auto& s = superiors[k];
      if (s && network.chance(0.01)) {
        s.reset();
        superior_down[k] = network.below(20);
      } else if (!s && superior_down[k]-- <= 0) {
        s = std::make_unique<Superior>(&network, &now, names[k]);
      }
      if (!s) continue;
      if (network.chance(k == 0 ? 0.08 : 0.03)) {
        Command order;
        order.valid_for = network.below(30) * kStep;
        const std::int64_t serial = s->port.send(order, now);
        ASSERT_GT(serial, s->serial);
        ASSERT_EQ(truth.acted_on.count({s->issuer, serial}), 0U) << "a serial was used again";
        s->serial = serial;
        last_valid_until = std::max(last_valid_until, now + order.valid_for);
      }
      s->port.step(now);
    }
    if (worker) {
      worker->cycle(now, &network, &truth);
      if (testing::Test::HasFatalFailure()) return;
      worker_received = now;
    }
    // Silence of any participant ends with the vehicle at rest.
    ASSERT_FALSE(truth.moving && now >= last_valid_until) << "moves without a valid command";
    for (const auto& s : superiors) {
      if (!s) continue;
      const CommandProgress current = s->port.progress(now);
      if (current.state == CommandProgress::State::kDone) {
        ASSERT_EQ(truth.done.count({s->issuer, s->serial}), 1U) << "a stale DONE was accepted";
      }
      const Duration silent = now - worker_received;
      const Duration longest = CommandPortParams{}.silence + network.flaws.delay_steps * kStep;
      if (current.state == CommandProgress::State::kExecuting) {
        ASSERT_LE(silent, longest + kStep) << "a dead subordinate is reported as working";
      }
    }
  }
}

}  // namespace rcs::test
