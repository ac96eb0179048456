#include "tests/live_faults/redirected_programs.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <utility>

namespace rcs::live_faults {
namespace {

namespace fs = std::filesystem;

constexpr char kFolder[] = "RCS_BIN_DIR";
/// `rcs` starts the nodes that are next to it: a link would lead it back to the build.
constexpr char kCopy[] = "rcs_copy";

void write_script(const fs::path& path, const std::string& text) {
  fs::remove(path);
  std::ofstream(path) << "#!/bin/sh\n" << text;
  fs::permissions(path, fs::perms::owner_all);
}

}  // namespace

RedirectedPrograms::RedirectedPrograms(fs::path folder) : folder_(std::move(folder)) {
  const char* const build = std::getenv(kFolder);  // NOLINT(concurrency-mt-unsafe): one thread
  build_ = build == nullptr ? "." : build;
  fs::create_directories(folder_);
  for (const char* node : {"sp", "wm", "bg", "gateway", "sim", "dds_client"}) {
    fs::create_symlink(build_ / node, folder_ / node);
  }
  fs::copy_file(build_ / "rcs", folder_ / kCopy);
  fs::create_symlink(kCopy, folder_ / "rcs");
  (void)setenv(kFolder, folder_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

RedirectedPrograms::~RedirectedPrograms() {
  (void)setenv(kFolder, build_.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

void RedirectedPrograms::redirect(const std::string& program, const fs::path& file) const {
  if (program == "up") {
    const std::string rcs = (folder_ / kCopy).string();
    write_script(folder_ / "rcs", fmt::format("[ \"$1\" = up ] && exec {0} \"$@\" >>{1} 2>&1\n"
                                              "exec {0} \"$@\"\n",
                                              rcs, file.string()));
    return;
  }
  write_script(folder_ / program,
               fmt::format("case \" $* \" in *\" --check \"*) exec {0} \"$@\" ;; esac\n"
                           "exec {0} \"$@\" >>{1} 2>&1\n",
                           (build_ / program).string(), file.string()));
}

}  // namespace rcs::live_faults
