// rcs load

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "rcs/base/file_handle.h"
#include "tools/rcs/command.h"
#include "tools/rcs/terminal.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kLoadName = "load";

/// One slice of arithmetic that the optimizer cannot remove.
std::uint64_t spin(std::uint64_t x) {
  for (int i = 0; i < 1'000'000; ++i) x = x * 6364136223846793005U + 1442695040888963407U;
  return x;
}

void load_cpu(const InterruptGuard& interrupt) {
  volatile std::uint64_t sink = 1;
  while (!interrupt.requested()) sink = spin(sink);
}

void load_memory(const InterruptGuard& interrupt) {
  // Several times the last-level cache.
  std::vector<std::uint64_t> array(std::size_t{32} << 20);
  std::uint64_t round = 0;
  while (!interrupt.requested()) {
    ++round;
    for (std::uint64_t& v : array) v += round;
  }
}

Outcome load_io(const InterruptGuard& interrupt) {
  constexpr int kBlocks = 64;
  std::string path = (std::filesystem::temp_directory_path() / "rcs_load_XXXXXX").string();
  const FileHandle file(mkstemp(path.data()));
  if (!file.valid()) return Error{path + ": " + std::strerror(errno)};
  (void)unlink(path.c_str());  // no file remains, however the program ends
  const std::vector<char> block(std::size_t{1} << 20, 'x');
  for (int k = 0; !interrupt.requested(); ++k) {
    const off_t at = static_cast<off_t>(k % kBlocks) * static_cast<off_t>(block.size());
    if (pwrite(file.get(), block.data(), block.size(), at) < 0 || fsync(file.get()) != 0) {
      if (errno == EINTR) continue;
      return Error{path + ": " + std::strerror(errno)};
    }
  }
  return Done{};
}

class Load final : public Command {
 public:
  explicit Load(CLI::App* rcs)
      : Command(rcs->add_subcommand("load", "Load the computer until Ctrl-C")) {
    app()
        ->add_option("KIND", kind_,
                     "cpu: one core; io: write and fsync; memory: a stream of 256 MB")
        ->required()
        ->check(CLI::IsMember({"cpu", "io", "memory"}));
    app()->footer(
        "One thread; `rcs budget --load cpu` starts one for each core.\n"
        "Example:\n"
        "  rcs load cpu & rcs load io & sleep 60; kill %1 %2");
  }

  int run() override {
    const InterruptGuard interrupt;
    Outcome done = Done{};
    if (kind_ == "cpu") load_cpu(interrupt);
    if (kind_ == "memory") load_memory(interrupt);
    if (kind_ == "io") done = load_io(interrupt);
    return done ? kExitOk : fail(kLoadName, done.error());
  }

 private:
  std::string kind_;
};

}  // namespace

void add_load_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Load>(rcs));
}

}  // namespace rcs::cli
