// The one-definition rule, checked on the text of every source file: no compiler detects two files
// of one program that define a type of the same name differently.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/source_code.h"

namespace rcs {
namespace {

/// Words and single characters of blanked code, without preprocessor lines.
std::vector<std::string> tokens_of(const std::string& code) {
  std::vector<std::string> tokens;
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  bool line_begins = true;
  for (std::size_t i = 0; i < code.size();) {
    if (code[i] == '#' && line_begins) {
      while (i < code.size() && (code[i] != '\n' || code[i - 1] == '\\')) ++i;
    } else if (is_word(code[i])) {
      const std::size_t begin = i;
      while (i < code.size() && (is_word(code[i]) || code.compare(i, 2, "::") == 0)) {
        i += code[i] == ':' ? 2 : 1;
      }
      tokens.push_back(code.substr(begin, i - begin));
      line_begins = false;
    } else {
      if (code[i] == '\n') line_begins = true;
      if (!std::isspace(static_cast<unsigned char>(code[i]))) {
        tokens.emplace_back(1, code[i]);
        line_begins = false;
      }
      ++i;
    }
  }
  return tokens;
}

/// The name of the type whose definition begins with the keyword tokens[at]; empty: a declaration,
/// a template parameter or an elaborated name.
std::string defined_type(const std::vector<std::string>& tokens, std::size_t at) {
  const auto token = [&](std::size_t k) {
    return k < tokens.size() ? tokens[k] : std::string(";");
  };
  if (tokens[at] == "class" && at > 0 && tokens[at - 1] == "enum")
    return "";  // already found at `enum`
  std::size_t k = at + 1;
  if (tokens[at] == "enum" && (token(k) == "class" || token(k) == "struct")) ++k;
  if (token(k) == "alignas") {
    while (token(k) != ")" && token(k) != ";") ++k;
    ++k;
  }
  std::string name = token(k++);
  if (!std::isalpha(static_cast<unsigned char>(name[0]))) return "";
  if (token(k) == "<") {  // a specialization
    for (int depth = 0; token(k) != ";"; ++k) {
      name += token(k);
      depth += token(k) == "<" ? 1 : token(k) == ">" ? -1 : 0;
      if (depth == 0) break;
    }
    ++k;
  }
  if (token(k) == "final") ++k;
  if (token(k) == ":") {
    while (token(k) != "{" && token(k) != ";" && token(k) != ")") ++k;
  }
  return token(k) == "{" ? name : "";
}

/// Qualified names of the types that a file defines in named namespaces; not those inside another
/// type or a function.
std::vector<std::string> types_of(std::string_view text) {
  enum class Scope { kNamespace, kAnonymous, kOther };
  const std::vector<std::string> tokens = tokens_of(code_of(text));
  std::vector<std::string> found;
  std::vector<std::pair<Scope, std::string>> scopes;
  std::pair<Scope, std::string> next = {Scope::kOther, ""};
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    const std::string& t = tokens[i];
    if (t == "namespace" && i + 1 < tokens.size()) {
      next = tokens[i + 1] == "{" ? std::pair(Scope::kAnonymous, std::string())
                                  : std::pair(Scope::kNamespace, tokens[i + 1] + "::");
    } else if (t == ";") {
      next = {Scope::kOther, ""};  // an alias of a namespace
    } else if (t == "{") {
      scopes.push_back(next);
      next = {Scope::kOther, ""};
    } else if (t == "}" && !scopes.empty()) {
      scopes.pop_back();
    } else if (t == "struct" || t == "class" || t == "enum" || t == "union") {
      std::string name = defined_type(tokens, i);
      const bool named = std::all_of(scopes.begin(), scopes.end(), [](const auto& scope) {
        return scope.first == Scope::kNamespace;
      });
      if (name.empty() || !named) continue;
      std::string prefix;
      for (const auto& scope : scopes) prefix += scope.second;
      found.push_back(prefix + name);
    }
  }
  return found;
}

TEST(OneDefinition, TypesAreFoundWithTheirNamespace) {
  EXPECT_THAT(
      types_of(
          "namespace rcs::sp {\nclass A;\nclass A final : public B<int, C> { struct In {}; };\n"
          "template <class T, class U = int>\nvoid f(struct G* g) { struct Local {}; }\n"
          "enum class E : int { kOne };\nenum Plain { kTwo };\n"
          "template <>\nstruct hash<A> { int x; };\nstruct alignas(64) L { int i; };\n"
          "struct A::Hidden { int k; };\nnamespace { struct Own {}; }\n"
          "#define M(x) struct x {}\n// struct Comment {};\nstd::vector<class A*> v = {};\n"
          "namespace inner { struct Deep {}; }\n}\nstruct Global {};\n"),
      testing::ElementsAre("rcs::sp::A", "rcs::sp::E", "rcs::sp::Plain", "rcs::sp::hash<A>",
                           "rcs::sp::L", "rcs::sp::A::Hidden", "rcs::sp::inner::Deep", "Global"));
}

TEST(OneDefinition, NoTypeIsDefinedTwice) {
  std::map<std::string, std::string> types;  // and the file that defines each
  for_each_source(source_root(), [&](const std::string& path, const std::string& text) {
    for (const std::string& type : types_of(text)) {
      const auto [first, is_new] = types.emplace(type, path);
      EXPECT_TRUE(is_new) << path << ": " << type << " is defined in " << first->second
                          << ", too: a program that links both has undefined behavior";
    }
  });
  EXPECT_GT(types.size(), 100U);
}

}  // namespace
}  // namespace rcs
