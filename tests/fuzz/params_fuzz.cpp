// libFuzzer: the bytes as a parameter file. It is read, or rejected with its name; each key read
// from it gives a value or an error.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "rcs/node/params/params.h"
#include "rcs/node/process/process.h"
#include "tests/fuzz/seeds.h"

namespace {

using rcs::test::Bytes;

/// The configurations of the project, and texts that have broken a parser.
std::vector<Bytes> seeds() {
  std::vector<Bytes> all;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(RCS_FUZZ_CONFIG)) {
    if (entry.path().extension() != ".toml") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    all.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  for (const std::string_view text :
       {"[~x]\n", "a.b.c = 1\n[[a.d]]\n", "a = [[1, 2], {b = 1979-05-27T07:32:00Z}]\n",
        "\"x\" = '''\n'''\ny = 0x1F\nz = +inf\n", "a = \"\\u00e9\"\n"}) {
    all.emplace_back(text.begin(), text.end());
  }
  return all;
}

/// Reads each key as each type of value, to some depth.
void read_all(rcs::ParamTable table, int depth) {
  for (const std::string& key : table.keys()) {
    double number = 0.0;
    std::int64_t whole = 0;
    bool flag = false;
    std::string text;
    rcs::Vec3 vector;
    std::vector<int> list;
    std::vector<std::string> texts;
    table.get(key, &number, {-1e3, 1e3});
    table.get(key, &whole, {-1e3, 1e3});
    table.get(key, &flag);
    table.get(key, &text);
    table.get(key, &vector, {-1.0, 1.0});
    table.get(key, &list, {0, 9});
    table.get(key, &texts);
    if (depth == 0) continue;
    for (const rcs::ParamTable& inner : table.tables(key)) read_all(inner, depth - 1);
    read_all(table.table(key), depth - 1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const rcs::Result<rcs::ParamFile> file = rcs::ParamFile::parse(text, "file");
  if (!file) {
    RCS_CHECK(file.error().message.substr(0, 5) == "file:");
    return 0;
  }
  (void)rcs::read_process_tables(*file);
  (void)file->finish({});
  const rcs::Result<rcs::ParamFile> again = rcs::ParamFile::parse(text, "file");
  RCS_CHECK(again.ok());
  read_all(again->root(), 2);
  (void)again->finish({});
  return 0;
}
