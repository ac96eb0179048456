#include "rcs/node/params/params.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "rcs/base/regular_file.h"
#include "rcs/base/text.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/params/param_text.h"
#include "rcs/node/params/params_state.h"
#include "rcs/node/params/toml_limits.h"

namespace rcs {
namespace {

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

ParamTable::Entry* ParamFile::State::entry(const toml::table* table, std::string path) {
  for (ParamTable::Entry& e : entries) {
    if (e.path == path) return &e;
  }
  return &entries.emplace_back(ParamTable::Entry{this, table, std::move(path)});
}

void ParamFile::State::unknown_keys(const toml::table& table, std::string_view path,
                                    const std::vector<std::string>& skip,
                                    std::vector<ParamProblem>* found) const {
  const auto opened = std::find_if(entries.begin(), entries.end(),
                                   [&](const ParamTable::Entry& e) { return e.table == &table; });
  const std::vector<std::string> none;
  const std::vector<std::string>& known = opened == entries.end() ? none : opened->known;
  for (const auto& [key, node] : table) {
    const std::string_view key_name = key.str();
    if (std::find(skip.begin(), skip.end(), key_name) != skip.end()) continue;
    if (std::find(known.begin(), known.end(), key_name) == known.end()) {
      std::vector<std::string> possible = known;
      possible.insert(possible.end(), skip.begin(), skip.end());
      found->push_back({key.source().begin.line,
                        fmt::format("{}: {}unknown {} {}{}", origin(key.source()),
                                    path.empty() ? "" : fmt::format("[{}] ", path),
                                    node.is_table() || node.is_array_of_tables() ? "table" : "key",
                                    key_name, suggestion(key_name, possible))});
    } else if (const toml::table* inner = node.as_table()) {
      unknown_keys(*inner, full_key(path, key_name), none, found);
    } else if (const toml::array* array = node.as_array()) {
      for (std::size_t i = 0; i < array->size(); ++i) {
        if (const toml::table* element = array->get(i)->as_table()) {
          unknown_keys(*element, fmt::format("{}[{}]", full_key(path, key_name), i), none, found);
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
  state->text = std::string(text);
  state->root = std::move(parsed).table();
  return ParamFile(std::move(state));
}

Result<ParamFile> ParamFile::load(const std::string& path) { return load_copy(path, path); }

Result<ParamFile> ParamFile::load_copy(const std::string& copy, const std::string& path) {
  if (Outcome checked = check_regular_file(copy); !checked) return checked.error();
  std::ifstream file(copy, std::ios::binary);
  if (!file) return Error{fmt::format("{}: cannot open: {}", copy, std::strerror(errno))};
  std::string text(kMaxTomlBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return Error{copy + ": cannot read"};
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

const std::string& ParamFile::text() const { return state_->text; }

std::int64_t ParamFile::text_id() const { return id_of(state_->text); }

std::string ParamFile::resolve(std::string_view path) const {
  return (std::filesystem::path(state_->name).parent_path() / path).string();
}

Outcome ParamFile::finish(const std::vector<std::string>& tables_of_others) const {
  std::vector<ParamProblem> unknown;
  state_->unknown_keys(state_->root, "", tables_of_others, &unknown);
  const auto by_line = [](const ParamProblem& a, const ParamProblem& b) { return a.line < b.line; };
  std::stable_sort(unknown.begin(), unknown.end(), by_line);
  state_->problems = state_->errors;
  state_->problems.insert(state_->problems.end(), unknown.begin(), unknown.end());
  if (state_->problems.empty()) return Done{};
  // Errors of values that were read precede unknown keys.
  const Error first{state_->problems.front().text};
  std::stable_sort(state_->problems.begin(), state_->problems.end(), by_line);
  return first;
}

std::vector<std::string> ParamFile::problems() const {
  std::vector<std::string> texts;
  for (const ParamProblem& problem : state_->problems) texts.push_back(problem.text);
  return texts;
}

const std::vector<ParamDescription>& ParamFile::described() const { return state_->described; }

}  // namespace rcs
