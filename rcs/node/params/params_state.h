#pragma once
// Implementation of ParamFile and ParamTable: the parsed file. For their source files only.

#include <fmt/format.h>

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/params/params.h"

#define TOML_EXCEPTIONS 0
// toml++ 3.3 asserts conditions that input can violate ("[~x]"), and reports them as errors right
// after the assertion. NDEBUG is no alternative: the compiler could assume the conditions.
#define TOML_ASSERT(condition) static_cast<void>(0)
#define TOML_MAX_NESTED_VALUES 32
#include <toml++/toml.h>

namespace rcs {

/// An error at a line of the file.
struct ParamProblem {
  std::uint32_t line = 0;  ///< 0: unknown
  std::string text;
};

struct ParamFile::State {
  std::string name;
  std::string text;
  toml::table root;
  std::deque<ParamTable::Entry> entries;  // addresses stay
  std::vector<ParamProblem> errors;       // of the reads
  std::vector<ParamProblem> problems;     // of the last finish(): errors and unknown keys
  std::vector<ParamDescription> described;

  ParamTable::Entry* entry(const toml::table* table, std::string path);
  void unknown_keys(const toml::table& table, std::string_view path,
                    const std::vector<std::string>& skip, std::vector<ParamProblem>* found) const;
};

/// A table that was opened. One missing from the file is an entry, too: its keys keep defaults.
struct ParamTable::Entry {
  ParamFile::State* file;
  const toml::table* table;  // null: not in the file
  std::string path;          // "sp.icp"; empty: the root
  std::vector<std::string> known{};

  const toml::node* find(std::string_view key);
  void fail(const toml::node* node, std::string_view key, std::string_view what);
  template <class T>
  bool read_number(const toml::node& node, std::string_view key, T* value, Range range);
  bool read_vec3(std::string_view key, Vec3* value, Range range);
  const toml::array* find_list(std::string_view key);
  void describe(const toml::node* node, ParamDescription description);
};

/// The file or the override that a node comes from, with its line.
inline std::string origin(const toml::source_region& source) {
  return fmt::format("{}:{}", source.path ? *source.path : "", source.begin.line);
}

}  // namespace rcs
