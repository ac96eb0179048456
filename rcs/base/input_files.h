#pragma once
// The files that a process opens as inputs, so that a program can protect them from its outputs.

#include <string>

namespace rcs {

/// Call it for a file that is opened as an input; check_regular_file() does.
void report_input(const std::string& path);

/// From now on, `observer` is called for each input, by the thread that opens it.
void observe_inputs(void (*observer)(const std::string& path));

}  // namespace rcs
