#pragma once
// Text for a terminal: lines, and similar words.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace rcs {

/// Widest line of help, tables and reports.
constexpr std::size_t kTextColumns = 100;

/// A line broken between words, so that none has more than kTextColumns; a single longer word
/// stays.
/// @param indent  blanks before the second and all further lines
[[nodiscard]] std::string wrapped(std::string_view line, std::size_t indent);

/// The known word that is most similar to the given one; empty: none is similar.
[[nodiscard]] std::string most_similar(std::string_view word,
                                       const std::vector<std::string>& known);

/// "; did you mean gate_m?" if a known word is similar to the given one; else empty.
[[nodiscard]] std::string suggestion(std::string_view word, const std::vector<std::string>& known);

}  // namespace rcs
