#include "tools/rcs/reference/lcm_file.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <system_error>

#include "tools/base/files.h"

namespace rcs::cli {

LcmType parse_lcm(const std::string& text) {
  static const std::regex kStruct("struct (\\w+)");
  static const std::regex kField("(\\w+) (\\w+)((\\[\\w+\\])*);");
  static const std::regex kConstant("([A-Z][A-Z0-9_]*) *= *(-?\\d+)");
  LcmType type;
  std::string* comment = &type.comment;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const std::size_t slashes = line.find("//");
    const std::string code = line.substr(0, slashes);
    std::smatch m;
    if (std::regex_search(code, m, kConstant)) {
      for (std::sregex_iterator c(code.begin(), code.end(), kConstant), end; c != end; ++c) {
        type.constants.push_back({(*c)[1], (*c)[2], ""});
      }
      comment = &type.constants.back().comment;
    } else if (std::regex_search(code, m, kStruct)) {
      type.name = m[1];
    } else if (!type.name.empty() && std::regex_search(code, m, kField)) {
      type.fields.push_back({m[1].str() + m[3].str(), m[2], ""});
      comment = &type.fields.back().comment;
    }
    if (slashes == std::string::npos) continue;
    const std::size_t begin = line.find_first_not_of("/ ", slashes);
    if (begin == std::string::npos) continue;
    *comment += (comment->empty() ? "" : " ") + line.substr(begin);
  }
  return type;
}

Result<std::vector<LcmType>> read_lcm_files(const std::string& folder) {
  std::vector<LcmType> types;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".lcm") continue;
    const Result<std::string> text = tools::read_text(entry.path());
    if (!text) return text.error();
    types.push_back(parse_lcm(*text));
  }
  if (types.empty()) return Error{folder + ": no message definitions (*.lcm)"};
  std::sort(types.begin(), types.end(),
            [](const LcmType& a, const LcmType& b) { return a.name < b.name; });
  return types;
}

}  // namespace rcs::cli
