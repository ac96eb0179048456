#pragma once
// Text of files for a terminal.

#include <string>
#include <string_view>

namespace rcs {

/// The text with its control characters escaped as in TOML ("\\u001b"), because a terminal would
/// execute them. Line breaks and tabs are kept, and so is UTF-8, except for its second set of
/// control characters (U+0080 to U+009F).
[[nodiscard]] std::string printable(std::string_view text);

/// The same in one line: line breaks and tabs are escaped, too.
[[nodiscard]] std::string printable_line(std::string_view text);

}  // namespace rcs
