#include "tests/support/source_code.h"

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace rcs {

namespace fs = std::filesystem;

fs::path source_root() {
  const char* const root = std::getenv("RCS_SOURCE_DIR");  // NOLINT(concurrency-mt-unsafe)
  if (root == nullptr) throw std::runtime_error("RCS_SOURCE_DIR must name the source tree's root");
  return root;
}

/// docs/ has examples: programs of users, who have their own rules.
bool is_source_folder(std::string_view name) {
  return name != ".git" && name != "docs" && name != "out" && name != "build" &&
         name.substr(0, 6) != "build-";
}

void for_each_source(
    const fs::path& root,
    const std::function<void(const std::string& path, const std::string& text)>& visit) {
  for (const auto& top : fs::directory_iterator(root)) {
    if (!top.is_directory() || !is_source_folder(top.path().filename().string())) continue;
    for (const auto& entry : fs::recursive_directory_iterator(top.path())) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream in(entry.path());
      const std::string text((std::istreambuf_iterator<char>(in)), {});
      visit(entry.path().lexically_relative(root).generic_string(), text);
    }
  }
}

std::string code_of(std::string_view text) {
  std::string code;
  code.reserve(text.size());
  const auto skip_to = [&](std::size_t from, std::string_view end, std::size_t keep) {
    const std::size_t at = text.find(end, from);
    const std::size_t stop = at == std::string_view::npos ? text.size() : at + keep;
    for (std::size_t i = from; i < stop; ++i) {
      if (text[i] == '\n') code += '\n';
    }
    return stop;
  };
  const auto starts = [&](std::size_t at, std::string_view what) {
    return text.substr(at, what.size()) == what;
  };
  std::size_t i = 0;
  bool line_is_include = false;
  while (i < text.size()) {
    const char c = text[i];
    const bool in_word = !code.empty() && (std::isalnum(static_cast<unsigned char>(code.back())));
    if (code.empty() || code.back() == '\n') line_is_include = starts(i, "#include");
    if (starts(i, "//")) {
      i = skip_to(i, "\n", 0);
    } else if (starts(i, "/*")) {
      i = skip_to(i + 2, "*/", 2);
    } else if (!in_word && starts(i, "R\"")) {
      const std::size_t open = text.find('(', i);
      if (open == std::string_view::npos) return code;
      const std::string end = ")" + std::string(text.substr(i + 2, open - i - 2)) + "\"";
      i = skip_to(open, end, end.size());
    } else if (!line_is_include && (c == '"' || (c == '\'' && !in_word))) {
      for (++i; i < text.size() && text[i] != c && text[i] != '\n'; ++i) {
        if (text[i] == '\\') ++i;
      }
      if (i < text.size() && text[i] == c) ++i;
      code += ' ';
    } else {
      code += c;
      ++i;
    }
  }
  return code;
}

}  // namespace rcs
