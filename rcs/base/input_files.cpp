#include "rcs/base/input_files.h"

#include <atomic>

namespace rcs {
namespace {

std::atomic<void (*)(const std::string&)> input_observer{nullptr};

}  // namespace

void report_input(const std::string& path) {
  if (auto* const observer = input_observer.load(); observer != nullptr) observer(path);
}

void observe_inputs(void (*observer)(const std::string& path)) { input_observer = observer; }

}  // namespace rcs
