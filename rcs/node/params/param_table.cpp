#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <type_traits>

#include "rcs/base/check.h"
#include "rcs/node/params/param_text.h"
#include "rcs/node/params/params_state.h"

namespace rcs {

namespace {

std::string shown(const toml::node& node) {
  constexpr std::size_t kMax = 200;  // of a list or a string of any length
  std::ostringstream out;
  node.visit([&](const auto& n) { out << n; });
  const std::string text = out.str();
  return text.size() > kMax ? text.substr(0, kMax) + "..." : text;
}

std::string where(std::string_view file, const toml::node* node, std::string_view path) {
  std::string text = node != nullptr ? origin(node->source()) : std::string(file);
  text += ": ";
  if (!path.empty()) text += fmt::format("[{}] ", path);
  return text;
}

/// The shortest usual form, e.g. 0.1 for degrees converted to radians and back. NaN is the default
/// of optional values.
std::string number(double v) {
  return std::isnan(v) ? "none" : fmt::format("{:.10g}", v == 0.0 ? 0.0 : v);
}

/// The default of a key whose unit is not that of the code: four digits, because the conversion of
/// a round value is not round. A value of the file is printed as it is written.
/// @param node  the value in the file; null: the default applies
std::string converted(double v, const toml::node* node) {
  return node != nullptr || std::isnan(v) ? number(v) : number(std::stod(fmt::format("{:.4g}", v)));
}

std::string numbers(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", number(v.x()), number(v.y()), number(v.z()));
}

std::string toml_text(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

std::string comma_separated(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all;
}

}  // namespace

const toml::node* ParamTable::Entry::find(std::string_view key) {
  if (std::find(known.begin(), known.end(), key) == known.end()) known.emplace_back(key);
  return table == nullptr ? nullptr : table->get(key);
}

void ParamTable::Entry::fail(const toml::node* node, std::string_view key, std::string_view what) {
  const toml::node* const place = node != nullptr ? node : table;
  file->errors.push_back({place != nullptr ? place->source().begin.line : 0,
                          where(file->name, place, path) + std::string(key) +
                              (node != nullptr ? " = " + shown(*node) : "") + ": " +
                              std::string(what)});
}

template <class T>
bool ParamTable::Entry::read_number(const toml::node& node, std::string_view key, T* value,
                                    Range range) {
  double number = 0.0;
  if constexpr (std::is_floating_point_v<T>) {
    const auto v = node.value<double>();  // accepts integers, too
    if (!node.is_number() || !v) return fail(&node, key, "not a number"), false;
    if (!std::isfinite(*v)) return fail(&node, key, "not finite"), false;
    number = *v;
    *value = number;
  } else {
    const auto* v = node.as_integer();
    if (v == nullptr) return fail(&node, key, "not a whole number"), false;
    number = static_cast<double>(v->get());
    // A range beyond that of the type is a bug of the caller.
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

/// @param node  the value in the file; null: the default applies
void ParamTable::Entry::describe(const toml::node* node, ParamDescription d) {
  d.table = path;
  if (node != nullptr) d.origin = origin(node->source());
  const auto same = [&](const ParamDescription& other) {
    return other.key == d.key && other.table == d.table;
  };
  if (std::none_of(file->described.begin(), file->described.end(), same)) {
    file->described.push_back(std::move(d));
  }
}

const toml::array* ParamTable::Entry::find_list(std::string_view key) {
  const toml::node* node = find(key);
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (node != nullptr && list == nullptr) fail(node, key, "not a list: write [a, b]");
  return list;
}

void ParamTable::get(std::string_view key, double* value, Range range, std::string_view meaning) {
  double v = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &v, range)) *value = v;
  entry_->describe(node, {"", std::string(key), "number", range, {}, number(*value), "", meaning});
}

void ParamTable::get(std::string_view key, int* value, Range range, std::string_view meaning) {
  // A range beyond that of the type is a bug of the caller.
  RCS_CHECK(range.min >= std::numeric_limits<int>::min() &&
            range.max <= std::numeric_limits<int>::max());
  std::int64_t v = *value;
  get(key, &v, range, meaning);
  *value = static_cast<int>(v);
}

void ParamTable::get(std::string_view key, std::int64_t* value, Range range,
                     std::string_view meaning) {
  const toml::node* node = entry_->find(key);
  if (node != nullptr) entry_->read_number(*node, key, value, range);
  entry_->describe(
      node, {"", std::string(key), "whole number", range, {}, std::to_string(*value), "", meaning});
}

void ParamTable::get(std::string_view key, bool* value, std::string_view meaning) {
  const toml::node* node = entry_->find(key);
  if (node != nullptr) {
    const auto* v = node->as_boolean();
    if (v == nullptr) {
      entry_->fail(node, key, "not true or false");
    } else {
      *value = v->get();
    }
  }
  entry_->describe(
      node,
      {"", std::string(key), "true or false", {}, {}, *value ? "true" : "false", "", meaning});
}

void ParamTable::get(std::string_view key, std::string* value, std::string_view meaning) {
  get(key, value, {}, meaning);
}

void ParamTable::get(std::string_view key, std::string* value,
                     const std::vector<std::string>& allowed, std::string_view meaning) {
  const toml::node* node = entry_->find(key);
  if (node != nullptr) {
    const auto* v = node->as_string();
    if (v == nullptr) {
      entry_->fail(node, key, "not a string");
    } else if (!allowed.empty() &&
               std::find(allowed.begin(), allowed.end(), v->get()) == allowed.end()) {
      entry_->fail(node, key, "not one of " + comma_separated(allowed));
    } else {
      *value = v->get();
    }
  }
  entry_->describe(node,
                   {"", std::string(key), "text", {}, allowed, toml_text(*value), "", meaning});
}

void ParamTable::get(std::string_view key, Vec3* value, Range range, std::string_view meaning) {
  const toml::node* node = entry_->find(key);
  entry_->read_vec3(key, value, range);
  entry_->describe(
      node, {"", std::string(key), "three numbers", range, {}, numbers(*value), "", meaning});
}

void ParamTable::get(std::string_view key, std::vector<int>* value, Range range,
                     std::string_view meaning) {
  const auto read = [&](const toml::array& list) {
    std::vector<int> v(list.size());
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (!entry_->read_number(*list.get(i), key, &v[i], range)) return;
    }
    *value = std::move(v);
  };
  if (const toml::array* list = entry_->find_list(key)) read(*list);
  std::vector<std::string> texts;
  for (const int v : *value) texts.push_back(std::to_string(v));
  entry_->describe(entry_->find(key), {"",
                                       std::string(key),
                                       "list of whole numbers",
                                       range,
                                       {},
                                       "[" + comma_separated(texts) + "]",
                                       "",
                                       meaning});
}

void ParamTable::get(std::string_view key, std::vector<std::string>* value,
                     std::string_view meaning) {
  const auto read = [&](const toml::array& list) {
    std::vector<std::string> v;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const auto* text = list.get(i)->as_string();
      if (text == nullptr) return entry_->fail(list.get(i), key, "not a string");
      v.push_back(text->get());
    }
    *value = std::move(v);
  };
  if (const toml::array* list = entry_->find_list(key)) read(*list);
  std::vector<std::string> texts;
  for (const std::string& text : *value) texts.push_back(toml_text(text));
  entry_->describe(entry_->find(key), {"",
                                       std::string(key),
                                       "list of texts",
                                       {},
                                       {},
                                       "[" + comma_separated(texts) + "]",
                                       "",
                                       meaning});
}

void ParamTable::get_scaled(std::string_view key, double unit, double* value, Range range,
                            std::string_view meaning) {
  double in_unit = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &in_unit, range)) {
    *value = in_unit * unit;
  }
  entry_->describe(
      node,
      {"", std::string(key), "number", range, {}, converted(*value / unit, node), "", meaning});
}

void ParamTable::get_ms(std::string_view key, Duration* value, Range range_ms,
                        std::string_view meaning) {
  RCS_CHECK(ends_with(key, "_ms"));
  double ms = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &ms, range_ms)) {
    *value = from_milliseconds(ms);
  }
  entry_->describe(
      node,
      {"", std::string(key), "number", range_ms, {}, number(seconds(*value) * 1e3), "", meaning});
}

void ParamTable::get_deg(std::string_view key, double* value_rad, Range range_deg,
                         std::string_view meaning) {
  RCS_CHECK(ends_with(key, "_deg"));
  double deg = 0.0;
  const toml::node* node = entry_->find(key);
  if (node != nullptr && entry_->read_number(*node, key, &deg, range_deg)) {
    *value_rad = radians(deg);
  }
  entry_->describe(node, {"",
                          std::string(key),
                          "number",
                          range_deg,
                          {},
                          converted(degrees(*value_rad), node),
                          "",
                          meaning});
}

void ParamTable::get_pose(std::string_view prefix, Pose* value, Range range_m,
                          std::string_view meaning) {
  get(fmt::format("{}_m", prefix), &value->p, range_m, meaning);
  constexpr Range kTurn{-360.0, 360.0};
  const Mat3 R = value->q.toRotationMatrix();
  Vec3 rpy_deg(degrees(std::atan2(R(2, 1), R(2, 2))),
               degrees(std::asin(std::clamp(-R(2, 0), -1.0, 1.0))),
               degrees(std::atan2(R(1, 0), R(0, 0))));
  const std::string key = fmt::format("{}_rpy_deg", prefix);
  if (entry_->read_vec3(key, &rpy_deg, kTurn)) {
    value->q = Eigen::AngleAxisd(radians(rpy_deg.z()), Vec3::UnitZ()) *
               Eigen::AngleAxisd(radians(rpy_deg.y()), Vec3::UnitY()) *
               Eigen::AngleAxisd(radians(rpy_deg.x()), Vec3::UnitX());
  }
  entry_->describe(entry_->find(key), {"",
                                       key,
                                       "three numbers",
                                       kTurn,
                                       {},
                                       numbers(rpy_deg),
                                       "",
                                       "Roll, pitch and yaw: R = Rz(yaw) Ry(pitch) Rx(roll)."});
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
  return ParamTable(entry_->file->entry(found, full_key(entry_->path, key)));
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
    const std::string path = fmt::format("{}[{}]", full_key(entry_->path, key), i);
    out.push_back(ParamTable(entry_->file->entry(found, path)));
  }
  return out;
}

void ParamTable::fail(std::string_view key, std::string_view what) {
  entry_->fail(entry_->find(key), key, what);
}

}  // namespace rcs
