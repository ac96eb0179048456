#pragma once
// Messages of Cyclone DDS itself, e.g. about participants without a valid identity.

#include <dds/dds.h>
#include <dds/ddsrt/log.h>
#include <limits.h>

#include <exception>
#include <string>
#include <string_view>

#include "rcs/base/printable.h"
#include "rcs/node/process/terminal_line.h"

namespace rcs::dds {

/// They are printed to stderr without waiting. The default of Cyclone DDS waits, so that a full
/// pipe or a stopped terminal would block its threads, and with them the commands of operators.
/// Call it before the first entity is created.
inline void log_without_waiting() {
  const dds_log_write_fn_t print = [](void*, const dds_log_data_t* data) {
    try {
      std::string_view text(data->message, data->size);
      while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
      std::string line = "DDS: " + printable_line(text);
      if (line.size() >= PIPE_BUF) line.resize(PIPE_BUF - 1);
      (void)write_without_waiting(line + "\n");
    } catch (const std::exception&) {
      return;  // no memory for the text
    }
  };
  dds_set_log_sink(print, nullptr);
}

}  // namespace rcs::dds
