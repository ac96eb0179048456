#pragma once
// Strict parameters from TOML: the file mirrors the struct, an unknown or out-of-range key is an
// error that names file, line, key, unit (in the key's suffix) and the allowed range.
// A missing key keeps the struct's default.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs {

struct Range {
  double min = 0.0;
  double max = 0.0;
};

class ParamFile;

/// Reads one table. Errors are collected; the first is returned by ParamFile::finish().
class ParamTable {
 public:
  void get(std::string_view key, double* value, Range range);
  void get(std::string_view key, int* value, Range range);
  void get(std::string_view key, std::int64_t* value, Range range);
  void get(std::string_view key, bool* value);
  void get(std::string_view key, std::string* value);
  void get(std::string_view key, std::string* value, const std::vector<std::string>& allowed);
  void get(std::string_view key, Vec3* value, Range range);  ///< array of three
  /// Key ends in _ms: milliseconds in the file.
  void get_ms(std::string_view key, Duration* value, Range range_ms);
  /// Key ends in _deg: degrees in the file, radians in the struct.
  void get_deg(std::string_view key, double* value_rad, Range range_deg);
  /// Keys <prefix>_m (three metres) and <prefix>_rpy_deg (roll, pitch, yaw; R = Rz Ry Rx).
  void get_pose(std::string_view prefix, Pose* value, Range range_m);

  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] ParamTable table(std::string_view key);  ///< empty when missing
  /// Tables of an array of tables ([[key]]), in order.
  [[nodiscard]] std::vector<ParamTable> tables(std::string_view key);

 private:
  friend class ParamFile;
  struct Node;
  std::shared_ptr<Node> node_;
};

/// A parsed file; tables read from it mark keys as known.
class ParamFile {
 public:
  static Result<ParamFile> load(const std::string& path);
  static Result<ParamFile> parse(std::string_view text, std::string_view name);

  [[nodiscard]] ParamTable root() const;
  /// Paths inside a file are relative to the file.
  [[nodiscard]] std::string resolve(std::string_view path) const;

  /// The first error of any read; else an unknown key, anywhere but in the named top-level tables
  /// that belong to other programs.
  [[nodiscard]] Outcome finish(const std::vector<std::string>& tables_of_others) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace rcs
