#pragma once
// The standard streams of `rcs`: a message never ends the work, and never controls the terminal.

#include <string_view>

namespace rcs::cli {

/// Opens those of the descriptors 0 to 2 that are closed: a file that the command opens would get
/// their number, and messages would be written to it. Results that are printed to a closed stdout
/// are an error, as on a full disk. Call it first in main().
void open_standard_streams();

/// From now on, what is printed to stderr has its control characters escaped (names and texts of
/// files are part of messages), and what cannot be written is lost without an error or a SIGPIPE.
/// @throws std::bad_alloc
void protect_messages();

/// Prints a line that is replaced later to stderr, a terminal. Control characters of the text are
/// escaped.
void replace_line(std::string_view text);

}  // namespace rcs::cli
