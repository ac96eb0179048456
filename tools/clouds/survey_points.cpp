#include "tools/clouds/survey_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "rcs/base/regular_file.h"
#include "tools/clouds/cloud_layout.h"
#include "tools/clouds/las_header.h"

namespace rcs::clouds {
namespace {

constexpr std::size_t kBlock = 65536;

/// A class is an integer in [0, 255]; other values become kNoClass.
std::int16_t class_of(double number) {
  return number >= 0.0 && number <= 255.0 ? static_cast<std::int16_t>(number) : kNoClass;
}

/// Consecutive records of equal size.
class RecordReader {
 public:
  RecordReader(std::ifstream in, std::string name, std::int64_t begin, std::int64_t record_bytes,
               std::int64_t records)
      : in_(std::move(in)),
        name_(std::move(name)),
        begin_(begin),
        record_bytes_(static_cast<std::size_t>(record_bytes)),
        records_(records) {}

  Outcome rewind() {
    in_.clear();
    in_.seekg(begin_);
    left_ = records_;
    return in_ ? Outcome(Done{}) : Outcome(Error{name_ + ": can't be read"});
  }
  /// @return number of records; their bytes are data()
  Result<std::size_t> next() {
    const std::size_t n = std::min(kBlock, static_cast<std::size_t>(left_));
    bytes_.resize(n * record_bytes_);
    in_.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    if (static_cast<std::size_t>(in_.gcount()) != bytes_.size()) {
      return Error{name_ + ": can't be read to its end; the file may have changed meanwhile"};
    }
    left_ -= static_cast<std::int64_t>(n);
    return n;
  }
  [[nodiscard]] const std::uint8_t* record(std::size_t k) const {
    return bytes_.data() + k * record_bytes_;
  }

 private:
  std::ifstream in_;
  std::string name_;
  std::int64_t begin_;
  std::size_t record_bytes_;
  std::int64_t records_;
  std::int64_t left_ = 0;
  std::vector<std::uint8_t> bytes_;
};

class LasPoints final : public SurveyPointFile {
 public:
  LasPoints(LasHeader header, RecordReader records)
      : header_(std::move(header)), records_(std::move(records)) {}

  const SurveyCrs& crs() const override { return header_.crs; }
  Outcome rewind() override { return records_.rewind(); }
  Outcome next(SurveyPoints* out) override {
    out->clear();
    const Result<std::size_t> n = records_.next();
    if (!n) return n.error();
    for (std::size_t k = 0; k < *n; ++k) add(records_.record(k), out);
    return Done{};
  }

 private:
  void add(const std::uint8_t* record, SurveyPoints* out) const {
    std::array<std::int32_t, 3> p{};
    std::memcpy(p.data(), record, sizeof p);
    // Byte 14 has return number and number of returns, 4 or 3 bits each; flags and class follow.
    const unsigned returns = record[14];
    const bool wide = header_.has_wide_classes();
    const unsigned number = wide ? returns & 15U : returns & 7U;
    const unsigned of = wide ? returns >> 4U : returns >> 3U & 7U;
    const unsigned klass = wide ? record[16] : record[15] & 31U;
    const bool withheld = ((wide ? record[15] >> 2U : record[15] >> 7U) & 1U) != 0;
    out->add(p[0] * header_.scale[0] + header_.offset[0],
             p[1] * header_.scale[1] + header_.offset[1],
             p[2] * header_.scale[2] + header_.offset[2], static_cast<std::int16_t>(klass),
             number >= of, withheld);
  }

  LasHeader header_;
  RecordReader records_;
};

class BinaryPoints final : public SurveyPointFile {
 public:
  BinaryPoints(RecordReader records, std::array<CloudLayout::Field, 4> fields,
               std::array<std::size_t, 4> offsets, bool has_class)
      : records_(std::move(records)),
        fields_(std::move(fields)),
        offsets_(offsets),
        has_class_(has_class) {}

  const SurveyCrs& crs() const override { return crs_; }
  Outcome rewind() override { return records_.rewind(); }
  Outcome next(SurveyPoints* out) override {
    out->clear();
    const Result<std::size_t> n = records_.next();
    if (!n) return n.error();
    const auto value = [this](std::size_t k, std::size_t a) {
      return load(fields_[a].type, records_.record(k) + offsets_[a]);
    };
    for (std::size_t k = 0; k < *n; ++k) {
      out->add(value(k, 0), value(k, 1), value(k, 2), has_class_ ? class_of(value(k, 3)) : kNoClass,
               true, false);
    }
    return Done{};
  }

 private:
  RecordReader records_;
  std::array<CloudLayout::Field, 4> fields_;
  std::array<std::size_t, 4> offsets_;
  bool has_class_;
  SurveyCrs crs_;
};

class TextPoints final : public SurveyPointFile {
 public:
  /// @param columns  of x, y, z and, if present, the class
  /// @param most  number of lines of points; the rest is not read
  TextPoints(std::ifstream in, std::string name, std::vector<std::size_t> columns,
             std::int64_t begin, int header_lines, std::int64_t most)
      : in_(std::move(in)),
        name_(std::move(name)),
        columns_(std::move(columns)),
        begin_(begin),
        header_lines_(header_lines),
        max_(most) {}

  const SurveyCrs& crs() const override { return crs_; }
  Outcome rewind() override {
    in_.clear();
    in_.seekg(begin_);
    line_number_ = header_lines_;
    left_ = max_;
    return in_ ? Outcome(Done{}) : Outcome(Error{name_ + ": can't be read"});
  }
  Outcome next(SurveyPoints* out) override {
    out->clear();
    const std::size_t least = *std::max_element(columns_.begin(), columns_.end()) + 1;
    std::vector<double> v(columns_.size());
    while (out->size() < kBlock && left_ > 0) {
      const Result<bool> read = next_line();
      if (!read) return read.error();
      if (!*read) break;
      const Result<std::size_t> found = parse_columns(line_, columns_, &v);
      const auto wrong = [this](const std::string& what) {
        return Error{fmt::format("{}:{}: {}", name_, line_number_, what)};
      };
      if (!found) return wrong(found.error().message);
      if (*found == 0) continue;
      if (*found < least) return wrong(fmt::format("{} columns, expected {}", *found, least));
      out->add(v[0], v[1], v[2], v.size() > 3 ? class_of(v[3]) : kNoClass, true, false);
      --left_;
    }
    const bool is_cut = left_ > 0 && out->size() < kBlock && max_ != INT64_MAX;
    if (is_cut) return Error{fmt::format("{}: {} points fewer than in the header", name_, left_)};
    return Done{};
  }

 private:
  /// @return false at the end
  Result<bool> next_line() {
    // A file without line ends must not be read into memory as one line.
    constexpr std::streamsize kLongestLine = 4096;
    std::array<char, kLongestLine> buffer{};
    in_.getline(buffer.data(), kLongestLine);
    if (in_.bad()) return Error{name_ + ": can't be read"};
    if (in_.fail() && in_.eof()) return false;
    ++line_number_;
    if (in_.fail()) {
      return Error{fmt::format("{}:{}: more than {} characters in a line", name_, line_number_,
                               kLongestLine)};
    }
    line_ = buffer.data();
    if (!line_.empty() && line_.back() == '\r') line_.pop_back();
    return true;
  }

  std::ifstream in_;
  std::string name_;
  std::vector<std::size_t> columns_;
  std::int64_t begin_;
  int header_lines_;
  std::int64_t max_;
  std::int64_t left_ = 0;
  int line_number_ = 0;
  std::string line_;
  SurveyCrs crs_;
};

using Opened = Result<std::unique_ptr<SurveyPointFile>>;

Opened open_las(std::ifstream in, std::int64_t size, const std::string& name) {
  Result<LasHeader> header = read_las_header(in, size, name);
  if (!header) return header.error();
  RecordReader records(std::move(in), name, header->data_at, header->record_bytes, header->points);
  return Opened(std::make_unique<LasPoints>(std::move(header).value(), std::move(records)));
}

Opened open_layout(std::ifstream in, std::int64_t size, const std::string& name, bool is_pcd) {
  constexpr std::int64_t kLongestHeader = 1 << 20;
  std::string head(static_cast<std::size_t>(std::min(size, kLongestHeader)), '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (static_cast<std::size_t>(in.gcount()) != head.size()) return Error{name + ": can't be read"};
  const Result<CloudLayout> layout =
      is_pcd ? parse_pcd_header(head, name) : parse_ply_header(head, name);
  if (!layout) return layout.error();
  const Result<std::array<std::size_t, 3>> axes = layout->axes(name);
  if (!axes) return axes.error();
  // CloudCompare writes scalar_Classification.
  std::optional<std::size_t> klass;
  for (const char* field : {"classification", "Classification", "class", "scalar_Classification"}) {
    if (!klass) klass = layout->index(field);
  }
  const auto begin = static_cast<std::int64_t>(layout->data_at);
  if (layout->ascii) {
    std::vector<std::size_t> columns(axes->begin(), axes->end());
    if (klass) columns.push_back(*klass);
    return Opened(std::make_unique<TextPoints>(std::move(in), name, std::move(columns), begin,
                                               layout->header_lines, layout->records));
  }
  const auto record_bytes = static_cast<std::int64_t>(layout->offset(layout->fields.size()));
  const std::int64_t room = (size - begin) / record_bytes;
  if (layout->records > room) {
    return Error{fmt::format("{}: header has {} points, the file {}", name, layout->records, room)};
  }
  std::array<CloudLayout::Field, 4> fields;
  std::array<std::size_t, 4> offsets{};
  for (std::size_t a = 0; a < 4; ++a) {
    const std::size_t at = a < 3 ? (*axes)[a] : klass.value_or((*axes)[0]);
    fields[a] = layout->fields[at];
    offsets[a] = layout->offset(at);
  }
  RecordReader records(std::move(in), name, begin, record_bytes, layout->records);
  return Opened(std::make_unique<BinaryPoints>(std::move(records), std::move(fields), offsets,
                                               klass.has_value()));
}

Opened open_xyz(std::ifstream in, const std::string& name, int class_column) {
  std::vector<std::size_t> columns = {0, 1, 2};
  if (class_column != 0) columns.push_back(static_cast<std::size_t>(class_column) - 1);
  return Opened(
      std::make_unique<TextPoints>(std::move(in), name, std::move(columns), 0, 0, INT64_MAX));
}

}  // namespace

void SurveyPoints::clear() {
  x.clear();
  y.clear();
  z.clear();
  klass.clear();
  last.clear();
  invalid.clear();
}

void SurveyPoints::add(double px, double py, double pz, std::int16_t its_class, bool is_last,
                       bool is_invalid) {
  const bool is_finite = std::isfinite(px) && std::isfinite(py) && std::isfinite(pz);
  x.push_back(px);
  y.push_back(py);
  z.push_back(pz);
  klass.push_back(its_class);
  last.push_back(is_last ? 1 : 0);
  invalid.push_back(is_invalid || !is_finite ? 1 : 0);
}

Result<std::unique_ptr<SurveyPointFile>> open_survey_points(const std::string& path,
                                                            int class_column) {
  std::string kind = path.substr(std::min(path.rfind('.'), path.size()));
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  constexpr std::array<std::string_view, 6> kKinds = {".las", ".laz", ".xyz",
                                                      ".txt", ".pcd", ".ply"};
  if (std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) {
    return Error{path + ": the name must end in .las, .xyz, .txt, .pcd or .ply"};
  }
  const bool is_text = kind == ".xyz" || kind == ".txt";
  if (class_column != 0 && !is_text) {
    return Error{path + ": --class-column is for .xyz and .txt: other files name their fields"};
  }
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::error_code error;
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(path, error));
  if (error) return Error{path + ": " + error.message()};
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{path + ": can't be read"};
  Opened file = is_text          ? open_xyz(std::move(in), path, class_column)
                : kind[1] == 'l' ? open_las(std::move(in), size, path)
                                 : open_layout(std::move(in), size, path, kind == ".pcd");
  if (!file) return file;
  if (Outcome begun = (*file)->rewind(); !begun) return begun.error();
  return file;
}

}  // namespace rcs::clouds
