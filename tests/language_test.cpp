// Documents and code use the terms of docs/glossary.md. Former names of what is public, and phrases
// of the project's old dialect, do not come back. ADRs, experiments and the change log are history.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>

#include "tests/support/source_code.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

/// Former public names: commands, keys, channels, message types, fields, states, events.
constexpr const char* kFormerNames[] = {
    "sureness",     "WM_SHADOW",     "shadow_t",      "ledger_t",        "WM_LEDGER",
    "gps_doubt",    "ladar_doubt",   "sigma_dead_m",  "lone_m",          "POSE_UNSURE",
    "SEEKING",      "FINDING_NORTH", "OVERDUE",       "NO_WAY",          "rcs truth",
    "map worth",    "[marks]",       "[wm.trust]",    "[sp.relocate]",   "[wm.sureness]",
    "map.doubt",    "way.none",      "way.held",      "dds.plain",       "evidence_again",
    "again_blocks", "input.refused", "facet.refused", "command.refused", "state.refused",
    "astray_m",     "units_of_work"};

/// Phrases that are wrong wherever they stand. Words with a common meaning are left to reviewers.
constexpr const char* kPhrases[] = {
    "that is none", "to and fro",     "led away",  "leads away",  "guilty",       "anew",
    "of late",      "bear out",       "bears out", "borne out",   "bore out",     "is told",
    "are told",     "honest",         "timid",     "how far off", "goes without", "go without",
    "testifies",    "testify",        "rival",     "convict",     "accuse",       "sureness",
    "grown over",   "standing points"};

bool is_history(const std::string& path) {
  return path == "CHANGELOG.md" || path.compare(0, 9, "docs/adr/") == 0 ||
         path.compare(0, 17, "docs/experiments/") == 0 || path == "tests/language_test.cpp";
}

bool is_text(const fs::path& path) {
  const std::string e = path.extension().string();
  return e == ".h" || e == ".cpp" || e == ".md" || e == ".toml" || e == ".lcm" || e == ".idl" ||
         e == ".sh" || e == ".txt" || e == ".cmake";
}

/// Lower case, with words that a line break divides joined: "to\n// and fro".
std::string flat(const std::string& text) {
  std::string out = std::regex_replace(text, std::regex("\\s*\\n\\s*(///?|#)?<?\\s*"), " ");
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

bool has_word(const std::string& text, const std::string& word) {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const bool begins = at == 0 || !is_part(text[at - 1]) || !is_part(word.front());
    const std::size_t end = at + word.size();
    const bool ends = end == text.size() || !is_part(text[end]) || !is_part(word.back());
    if (begins && ends) return true;
  }
  return false;
}

template <class Visit>
void for_each_text(const Visit& visit) {
  const fs::path root = source_root();
  const auto file = [&](const fs::path& path) {
    const std::string name = path.lexically_relative(root).generic_string();
    if (!is_text(path) || is_history(name)) return;
    std::ifstream in(path);
    visit(name, std::string{std::istreambuf_iterator<char>(in), {}});
  };
  for (const auto& top : fs::directory_iterator(root)) {
    const std::string name = top.path().filename().string();
    if (top.is_regular_file()) file(top.path());
    if (!top.is_directory() || (!is_source_folder(name) && name != "docs")) continue;
    for (const auto& entry : fs::recursive_directory_iterator(top.path())) {
      if (entry.is_regular_file()) file(entry.path());
    }
  }
}

TEST(Language, FormerNamesDoNotComeBack) {
  std::size_t files = 0;
  for_each_text([&](const std::string& path, const std::string& text) {
    ++files;
    for (const char* name : kFormerNames) {
      EXPECT_FALSE(has_word(text, name)) << path << ": " << name;
    }
  });
  EXPECT_GT(files, 100U);
}

TEST(Language, ProseIsPlain) {
  for_each_text([&](const std::string& path, const std::string& text) {
    const std::string prose = flat(text);
    for (const char* phrase : kPhrases) {
      EXPECT_FALSE(has_word(prose, phrase)) << path << ": \"" << phrase << "\"";
    }
  });
}

TEST(Language, PhrasesAreFoundAcrossLines) {
  EXPECT_TRUE(has_word(flat("// it goes to\n  // and fro\n"), "to and fro"));
  EXPECT_TRUE(has_word("x NO_WAY;", "NO_WAY"));
  EXPECT_FALSE(has_word("the arrival", "rival"));
}

}  // namespace
}  // namespace rcs
