#include "rcs/node/params/params.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <type_traits>

#include "rcs/base/regular_file.h"
#include "rcs/node/params/param_text.h"
#include "rcs/node/params/toml_limits.h"

#define TOML_EXCEPTIONS 0
// toml++ 3.3 asserts what input can break ("[~x]"), and reports it as an error right behind the
// assertion. Not by NDEBUG, which would let the compiler assume what is asserted.
#define TOML_ASSERT(condition) static_cast<void>(0)
#define TOML_MAX_NESTED_VALUES 32
#include <toml++/toml.h>

namespace rcs {

struct ParamFile::State {
  std::string name;
  toml::table root;
  std::deque<ParamTable::Entry> entries;  // addresses stay
  std::string first_error;

  ParamTable::Entry* entry(const toml::table* table, std::string path);
  void unknown_keys(const toml::table& table, std::string_view path,
                    const std::vector<std::string>& skip, std::string* first,
                    std::uint32_t* first_line) const;
};

/// A table that was opened. One that is not in the file is an entry, too: its keys keep defaults.
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
};

namespace {

std::string shown(const toml::node& node) {
  constexpr std::size_t kMost = 200;  // of a list or a string of any length
  std::ostringstream out;
  node.visit([&](const auto& n) { out << n; });
  const std::string text = out.str();
  return text.size() > kMost ? text.substr(0, kMost) + "..." : text;
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

/// The file, or the override, that a part of the tables is from, with its line.
std::string origin(const toml::source_region& source) {
  return fmt::format("{}:{}", source.path ? *source.path : "", source.begin.line);
}

std::string where(std::string_view file, const toml::node* node, std::string_view path) {
  std::string text = node != nullptr ? origin(node->source()) : std::string(file);
  text += ": ";
  if (!path.empty()) text += fmt::format("[{}] ", path);
  return text;
}

std::string joined(std::string_view path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

void merge(toml::table&& from, toml::table* into) {
  for (auto&& [key, node] : from) {
    toml::table* inner = node.as_table();
    toml::table* present = into->get_as<toml::table>(key.str());
    if (inner != nullptr && present != nullptr) {
      merge(std::move(*inner), present);
    } else {
      into->insert_or_assign(key, std::move(node));
    }
  }
}

}  // namespace

const toml::node* ParamTable::Entry::find(std::string_view key) {
  if (std::find(known.begin(), known.end(), key) == known.end()) known.emplace_back(key);
  return table == nullptr ? nullptr : table->get(key);
}

void ParamTable::Entry::fail(const toml::node* node, std::string_view key, std::string_view what) {
  if (!file->first_error.empty()) return;
  file->first_error = where(file->name, node != nullptr ? node : table, path) + std::string(key) +
                      (node != nullptr ? " = " + shown(*node) : "") + ": " + std::string(what);
}

template <class T>
bool ParamTable::Entry::read_number(const toml::node& node, std::string_view key, T* value,
                                    Range range) {
  double number = 0.0;
  if constexpr (std::is_floating_point_v<T>) {
    const auto v = node.value<double>();  // takes integers, too
    if (!node.is_number() || !v) return fail(&node, key, "not a number"), false;
    if (!std::isfinite(*v)) return fail(&node, key, "not finite"), false;
    number = *v;
    *value = number;
  } else {
    const auto* v = node.as_integer();
    if (v == nullptr) return fail(&node, key, "not a whole number"), false;
    number = static_cast<double>(v->get());
    // A range beyond the type's own is the caller's bug.
    RCS_CHECK(range.min >= static_cast<double>(std::numeric_limits<T>::min()) &&
              range.max <= static_cast<double>(std::numeric_limits<T>::max()));
    if (number >= range.min && number <= range.max) *value = static_cast<T>(v->get());
  }
  if (number < range.min || number > range.max) {
    fail(&node, key, fmt::format("not in [{}, {}]{}", range.min, range.max, unit_of(key)));
    return false;
  }
  return true;
}

bool ParamTable::Entry::read_vec3(std::string_view key, Vec3* value, Range range) {
  const toml::node* node = find(key);
  if (node == nullptr) return false;
  const toml::array* array = node->as_array();
  if (array == nullptr || array->size() != 3) {
    fail(node, key, "not an array of three numbers");
    return false;
  }
  Vec3 v;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!read_number(*array->get(i), key, &v[static_cast<Eigen::Index>(i)], range)) return false;
  }
  *value = v;
  return true;
}

const toml::array* ParamTable::Entry::find_list(std::string_view key) {
  const toml::node* node = find(key);
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (node != nullptr && list == nullptr) fail(node, key, "not a list: write [a, b]");
  return list;
}

void ParamTable::get(std::string_view key, double* value, Range range) {
  double v = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &v, range)) *value = v;
}

void ParamTable::get(std::string_view key, int* value, Range range) {
  const toml::node* node = entry_->find(key);
  if (node != nullptr) entry_->read_number(*node, key, value, range);
}

void ParamTable::get(std::string_view key, std::int64_t* value, Range range) {
  const toml::node* node = entry_->find(key);
  if (node != nullptr) entry_->read_number(*node, key, value, range);
}

void ParamTable::get(std::string_view key, bool* value) {
  const toml::node* node = entry_->find(key);
  if (node == nullptr) return;
  const auto* v = node->as_boolean();
  if (v == nullptr) return entry_->fail(node, key, "not true or false");
  *value = v->get();
}

void ParamTable::get(std::string_view key, std::string* value) {
  const toml::node* node = entry_->find(key);
  if (node == nullptr) return;
  const auto* v = node->as_string();
  if (v == nullptr) return entry_->fail(node, key, "not a string");
  *value = v->get();
}

void ParamTable::get(std::string_view key, std::string* value,
                     const std::vector<std::string>& allowed) {
  std::string v = *value;
  get(key, &v);
  const toml::node* node = entry_->find(key);
  if (node == nullptr || !node->is_string()) return;
  if (std::find(allowed.begin(), allowed.end(), v) == allowed.end()) {
    std::string names;
    for (const std::string& name : allowed) names += (names.empty() ? "" : ", ") + name;
    return entry_->fail(node, key, "not one of " + names);
  }
  *value = std::move(v);
}

void ParamTable::get(std::string_view key, Vec3* value, Range range) {
  entry_->read_vec3(key, value, range);
}

void ParamTable::get(std::string_view key, std::vector<int>* value, Range range) {
  const toml::array* list = entry_->find_list(key);
  if (list == nullptr) return;
  std::vector<int> v(list->size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!entry_->read_number(*list->get(i), key, &v[i], range)) return;
  }
  *value = std::move(v);
}

void ParamTable::get(std::string_view key, std::vector<std::string>* value) {
  const toml::array* list = entry_->find_list(key);
  if (list == nullptr) return;
  std::vector<std::string> v;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto* text = list->get(i)->as_string();
    if (text == nullptr) return entry_->fail(list->get(i), key, "not a string");
    v.push_back(text->get());
  }
  *value = std::move(v);
}

void ParamTable::get_ms(std::string_view key, Duration* value, Range range_ms) {
  RCS_CHECK(ends_with(key, "_ms"));
  double ms = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &ms, range_ms)) {
    *value = from_milliseconds(ms);
  }
}

void ParamTable::get_deg(std::string_view key, double* value_rad, Range range_deg) {
  RCS_CHECK(ends_with(key, "_deg"));
  double deg = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &deg, range_deg)) {
    *value_rad = radians(deg);
  }
}

void ParamTable::get_pose(std::string_view prefix, Pose* value, Range range_m) {
  Vec3 rpy_deg;
  entry_->read_vec3(fmt::format("{}_m", prefix), &value->p, range_m);
  if (entry_->read_vec3(fmt::format("{}_rpy_deg", prefix), &rpy_deg, {-360.0, 360.0})) {
    value->q = Eigen::AngleAxisd(radians(rpy_deg.z()), Vec3::UnitZ()) *
               Eigen::AngleAxisd(radians(rpy_deg.y()), Vec3::UnitY()) *
               Eigen::AngleAxisd(radians(rpy_deg.x()), Vec3::UnitX());
  }
}

bool ParamTable::has(std::string_view key) const {
  return entry_->table != nullptr && entry_->table->contains(key);
}

std::vector<std::string> ParamTable::keys() const {
  std::vector<std::string> names;
  if (entry_->table == nullptr) return names;
  for (const auto& [key, node] : *entry_->table) names.emplace_back(key.str());
  return names;
}

ParamTable ParamTable::table(std::string_view key) {
  const toml::node* node = entry_->find(key);
  const toml::table* found = node == nullptr ? nullptr : node->as_table();
  if (node != nullptr && found == nullptr) entry_->fail(node, key, "not a table");
  return ParamTable(entry_->file->entry(found, joined(entry_->path, key)));
}

std::vector<ParamTable> ParamTable::tables(std::string_view key) {
  std::vector<ParamTable> out;
  const toml::node* node = entry_->find(key);
  if (node == nullptr) return out;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    entry_->fail(node, key, fmt::format("not an array of tables: write [[{}]]", key));
    return out;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::table* found = array->get(i)->as_table();
    if (found == nullptr) {
      entry_->fail(node, key, fmt::format("element {} is not a table", i));
      continue;
    }
    const std::string path = fmt::format("{}[{}]", joined(entry_->path, key), i);
    out.push_back(ParamTable(entry_->file->entry(found, path)));
  }
  return out;
}

void ParamTable::fail(std::string_view key, std::string_view what) {
  entry_->fail(entry_->find(key), key, what);
}

ParamTable::Entry* ParamFile::State::entry(const toml::table* table, std::string path) {
  for (ParamTable::Entry& e : entries) {
    if (e.path == path) return &e;
  }
  return &entries.emplace_back(ParamTable::Entry{this, table, std::move(path)});
}

/// The unknown key that comes first in the file.
void ParamFile::State::unknown_keys(const toml::table& table, std::string_view path,
                                    const std::vector<std::string>& skip, std::string* first,
                                    std::uint32_t* first_line) const {
  const auto opened = std::find_if(entries.begin(), entries.end(),
                                   [&](const ParamTable::Entry& e) { return e.table == &table; });
  const std::vector<std::string> none;
  const std::vector<std::string>& known = opened == entries.end() ? none : opened->known;
  for (const auto& [key, node] : table) {
    const std::string_view key_name = key.str();
    if (std::find(skip.begin(), skip.end(), key_name) != skip.end()) continue;
    if (std::find(known.begin(), known.end(), key_name) == known.end()) {
      const std::uint32_t line = key.source().begin.line;
      if (line >= *first_line) continue;
      *first_line = line;
      *first = fmt::format("{}: {}unknown {} {}{}", origin(key.source()),
                           path.empty() ? "" : fmt::format("[{}] ", path),
                           node.is_table() || node.is_array_of_tables() ? "table" : "key", key_name,
                           suggestion(key_name, known));
    } else if (const toml::table* inner = node.as_table()) {
      unknown_keys(*inner, joined(path, key_name), none, first, first_line);
    } else if (const toml::array* array = node.as_array()) {
      for (std::size_t i = 0; i < array->size(); ++i) {
        if (const toml::table* element = array->get(i)->as_table()) {
          unknown_keys(*element, fmt::format("{}[{}]", joined(path, key_name), i), none, first,
                       first_line);
        }
      }
    }
  }
}

ParamFile::ParamFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
ParamFile::ParamFile(ParamFile&&) noexcept = default;
ParamFile& ParamFile::operator=(ParamFile&&) noexcept = default;
ParamFile::~ParamFile() = default;

Result<ParamFile> ParamFile::parse(std::string_view text, std::string_view name) {
  if (Outcome checked = check_toml_limits(text, name); !checked) return checked.error();
  toml::parse_result parsed = toml::parse(text, name);
  if (!parsed) {
    const toml::parse_error& e = parsed.error();
    return Error{fmt::format("{}:{}: {}", name, e.source().begin.line, e.description())};
  }
  auto state = std::make_unique<State>();
  state->name = std::string(name);
  state->root = std::move(parsed).table();
  return ParamFile(std::move(state));
}

Result<ParamFile> ParamFile::load(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{fmt::format("{}: cannot open: {}", path, std::strerror(errno))};
  std::string text(kMaxTomlBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return Error{path + ": cannot read"};
  text.resize(static_cast<std::size_t>(file.gcount()));
  return parse(text, path);
}

Result<ParamFile> ParamFile::load(const std::string& path,
                                  const std::vector<std::string>& overrides) {
  Result<ParamFile> file = load(path);
  if (!file) return file;
  for (const std::string& text : overrides) {
    Result<ParamFile> set = parse(text, text);
    if (!set) return set.error();
    merge(std::move(set->state_->root), &file->state_->root);
  }
  return file;
}

ParamTable ParamFile::root() const { return ParamTable(state_->entry(&state_->root, "")); }

const std::string& ParamFile::name() const { return state_->name; }

std::string ParamFile::resolve(std::string_view path) const {
  return (std::filesystem::path(state_->name).parent_path() / path).string();
}

Outcome ParamFile::finish(const std::vector<std::string>& tables_of_others) const {
  if (!state_->first_error.empty()) return Error{state_->first_error};
  std::string unknown;
  std::uint32_t line = std::numeric_limits<std::uint32_t>::max();
  state_->unknown_keys(state_->root, "", tables_of_others, &unknown, &line);
  return unknown.empty() ? Outcome(Done{}) : Outcome(Error{unknown});
}

}  // namespace rcs
