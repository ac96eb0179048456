#pragma once
// Strict parameters from TOML: the file mirrors the struct; a wrong type, a value out of range, a
// NaN or an unknown key is an error that names file, line, table, key and the allowed range.
// A missing key keeps the struct's default. The calls of get() are the only table of parameters:
// they define key, range and meaning; ParamFile::described() returns them.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs {

/// Allowed values, both ends included.
struct Range {
  double min = 0.0;
  double max = 0.0;
};

/// One parameter as its parser read it. The unit is the key's suffix.
struct ParamDescription {
  std::string table;  ///< "sp.icp"; empty: the root of the file
  std::string key;
  std::string type;              ///< "number", "three numbers", "text", ...
  std::optional<Range> range{};  ///< of each number
  std::vector<std::string> allowed{};
  std::string value;     ///< in force, as TOML: from the file, else the default
  std::string origin{};  ///< "file.toml:12"; empty: the default
  std::string_view meaning{};
};

class ParamFile;

/// A table of a ParamFile, which must outlive it. Errors are collected; ParamFile::finish() returns
/// the first. Reading a key makes it known; a key that is never read is an error, too.
/// @param meaning  of get(): a literal; describes the value and the effect of a change
class ParamTable {
 public:
  void get(std::string_view key, double* value, Range range, std::string_view meaning = {});
  void get(std::string_view key, int* value, Range range, std::string_view meaning = {});
  void get(std::string_view key, std::int64_t* value, Range range, std::string_view meaning = {});
  void get(std::string_view key, bool* value, std::string_view meaning = {});
  void get(std::string_view key, std::string* value, std::string_view meaning = {});
  void get(std::string_view key, std::string* value, const std::vector<std::string>& allowed,
           std::string_view meaning = {});
  void get(std::string_view key, Vec3* value, Range range,
           std::string_view meaning = {});  ///< array of three
  void get(std::string_view key, std::vector<int>* value, Range range,
           std::string_view meaning = {});  ///< range: of each
  void get(std::string_view key, std::vector<std::string>* value, std::string_view meaning = {});
  /// Key ends in _ms: milliseconds in the file.
  void get_ms(std::string_view key, Duration* value, Range range_ms, std::string_view meaning = {});
  /// Key ends in _deg: degrees in the file, radians in the struct.
  void get_deg(std::string_view key, double* value_rad, Range range_deg,
               std::string_view meaning = {});
  /// Keys <prefix>_m (three metres) and <prefix>_rpy_deg (roll, pitch, yaw; R = Rz Ry Rx).
  void get_pose(std::string_view prefix, Pose* value, Range range_m, std::string_view meaning = {});

  /// In the unit of the key: value * unit in the struct.
  void get_scaled(std::string_view key, double unit, double* value, Range range,
                  std::string_view meaning = {});

  [[nodiscard]] bool has(std::string_view key) const;
  /// For tables whose names the user chooses, such as [process.NAME]. Does not make them known.
  [[nodiscard]] std::vector<std::string> keys() const;
  [[nodiscard]] ParamTable table(std::string_view key);  ///< empty when missing
  /// Tables of an array of tables ([[key]]), in order.
  [[nodiscard]] std::vector<ParamTable> tables(std::string_view key);
  /// For a rule between keys: "file.toml:12: [sp.icp] gate_m: <what>".
  void fail(std::string_view key, std::string_view what);

 private:
  friend class ParamFile;
  struct Entry;
  explicit ParamTable(Entry* entry) : entry_(entry) {}

  Entry* entry_;
};

/// A parsed file.
class ParamFile {
 public:
  static Result<ParamFile> load(const std::string& path);
  /// @param overrides  TOML of one or more keys each ("odometry.constrained = false"), which
  ///   replace or extend those of the file; the last one that sets a key applies
  static Result<ParamFile> load(const std::string& path, const std::vector<std::string>& overrides);
  /// The content of `copy` under the name `path`: errors and relative paths are those of `path`.
  static Result<ParamFile> load_copy(const std::string& copy, const std::string& path);
  static Result<ParamFile> parse(std::string_view text, std::string_view name);

  ParamFile(ParamFile&&) noexcept;
  ParamFile& operator=(ParamFile&&) noexcept;
  ~ParamFile();

  [[nodiscard]] ParamTable root() const;
  [[nodiscard]] const std::string& name() const;
  /// Of the file, without overrides.
  [[nodiscard]] const std::string& text() const;
  /// A hash of text().
  [[nodiscard]] std::int64_t text_id() const;
  /// Paths inside a file are relative to the file.
  [[nodiscard]] std::string resolve(std::string_view path) const;

  /// The first error of any read; else an unknown key. The named top-level tables belong to other
  /// programs and are not checked.
  [[nodiscard]] Outcome finish(const std::vector<std::string>& tables_of_others) const;

  /// All errors of the last finish(), each "file.toml:12: [sp.icp] gate_m: ...", sorted by line.
  [[nodiscard]] std::vector<std::string> problems() const;
  /// Every parameter that was read so far, in order, and once each.
  [[nodiscard]] const std::vector<ParamDescription>& described() const;

 private:
  friend class ParamTable;
  struct State;
  explicit ParamFile(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace rcs
