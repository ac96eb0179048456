#include "tools/rcs/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "rcs/base/regular_file.h"

namespace rcs::tools {
namespace {

Error file_error(std::string_view path, std::string_view what) {
  return {fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

}  // namespace

Result<std::string> read_text(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return file_error(path, "cannot open");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  if (file.bad()) return file_error(path, "cannot read");
  return text;
}

Result<std::vector<std::uint8_t>> read_bytes(const std::string& path) {
  const Result<std::string> text = read_text(path);
  if (!text) return text.error();
  return std::vector<std::uint8_t>(text->begin(), text->end());
}

OutputFile::OutputFile(std::string path)
    : path_(std::move(path)), temporary_path_(fmt::format("{}.{}.partial", path_, ::getpid())) {
  const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
  std::error_code ignored;  // creating the file tells what is wrong
  if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
}

OutputFile::~OutputFile() { std::remove(temporary_path_.c_str()); }

Outcome OutputFile::commit() {
  if (std::rename(temporary_path_.c_str(), path_.c_str()) != 0) {
    return file_error(path_, "cannot move the finished file there");
  }
  return Done{};
}

Outcome write_text(const std::string& path, std::string_view text) {
  OutputFile out(path);
  std::ofstream file(out.temporary_path(), std::ios::binary);
  if (!file) return file_error(path, "cannot create");
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  if (!file) return file_error(path, "cannot write");
  return out.commit();
}

}  // namespace rcs::tools
