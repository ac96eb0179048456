#include "rcs/node/stop_latch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "rcs/node/process/process.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

/// Value of an environment variable; empty if it is not set.
std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): at the start
  return value == nullptr ? "" : value;
}

/// A relative folder would depend on the working directory: treated as not set.
std::string folder_variable(const char* name) {
  std::string value = variable(name);
  return fs::path(value).is_absolute() ? value : "";
}

std::string default_folder() {
  if (const std::string given = folder_variable("STATE_DIRECTORY"); !given.empty()) {
    return given.substr(0, given.find(':'));  // systemd separates several by colons
  }
  if (const std::string given = folder_variable("XDG_STATE_HOME"); !given.empty()) {
    return given + "/rcs";
  }
  if (const std::string home = folder_variable("HOME"); !home.empty()) {
    return home + "/.local/state/rcs";
  }
  return "";
}

}  // namespace

Result<StopLatch> StopLatch::open(const std::string& path) {
  if (const Outcome checked = check_stop_folder(path); !checked) return checked.error();
  StopLatch latch;
  latch.path_ = path;
  latch.writer_ = std::make_unique<StopWriterInCall>();
  LatchedStops latched = read_stop_file(path);
  if (latched.stops.empty()) return latch;
  latch.stops_ = std::move(latched.stops);
  latch.damage_ = std::move(latched.damage);
  // Of a damaged file, too: its existence is the latch, and no attempt to repair it may fail.
  latch.on_disk_ = latch.text_ = stop_file_text(latch.stops_);
  // The previous process may have been killed before the file was on the disk.
  latch.on_disk_known_ = sync_stop_file(path);
  return latch;
}

bool StopLatch::is_of(const stop_t& stop, std::string_view superior) {
  const std::string_view issuer = stop.issuer;
  if (issuer.substr(0, superior.size()) != superior) return false;
  return issuer.size() == superior.size() || issuer[superior.size()] == kOnBehalf;
}

bool StopLatch::persisted() const {
  return !engaged() || path_.empty() || (on_disk_known_ && on_disk_ == text_);
}

std::string StopLatch::cause() const {
  if (!damage_.empty()) return damage_;
  std::string issuers;
  for (auto s = stops_.begin(); s != stops_.end(); ++s) {
    const bool named = std::any_of(stops_.begin(), s,
                                   [s](const stop_t& other) { return other.issuer == s->issuer; });
    if (named) continue;
    if (!issuers.empty()) issuers += ", ";
    issuers += s->issuer.empty() ? "an unknown issuer" : s->issuer;
  }
  return issuers;
}

void StopLatch::engage(const stop_t& stop) {
  const auto with_id = [this](std::int64_t id) {
    return std::any_of(stops_.begin(), stops_.end(), [id](const stop_t& s) { return s.id == id; });
  };
  check_ = true;
  if (stop.id != 0 && with_id(stop.id)) return;
  // Whoever released the others did not know of this one.
  releasing_ = false;
  const bool full = stops_.size() >= kMaxStops;
  if ((stop.id == 0 || full) && with_id(0)) return;
  const bool has_name = stop.id != 0 && !full;
  stops_.push_back(has_name ? stop_t{stop.id, printable_name(stop.issuer)} : stop_t{});
  note_change();
}

StopLatch::Release StopLatch::release(const std::vector<std::int64_t>& ids, std::string_view by,
                                      bool authority, Stamp until) {
  const std::string name = printable_name(std::string(by));
  const auto ends = [&](const stop_t& s) {
    const bool permitted = authority || (s.id != 0 && is_of(s, name));
    return permitted && std::find(ids.begin(), ids.end(), s.id) != ids.end();
  };
  const auto ended = static_cast<std::size_t>(std::count_if(stops_.begin(), stops_.end(), ends));
  if (ended == 0) return Release::kNone;
  if (ended == stops_.size()) {
    releasing_ = true;
    release_until_ = until;
    next_try_ = Stamp::min();
    return Release::kAll;
  }
  for (const stop_t& s : stops_) {
    if (!ends(s)) continue;
    released_.push_back(s.id);
    if (s.id == 0) damage_.clear();
  }
  stops_.erase(std::remove_if(stops_.begin(), stops_.end(), ends), stops_.end());
  releasing_ = false;
  note_change();
  return Release::kSome;
}

void StopLatch::note_change() {
  text_ = stops_.empty() || path_.empty() ? "" : stop_file_text(stops_);
  next_try_ = Stamp::min();
}

void StopLatch::finish() {
  if (!writer_ || path_.empty()) return;
  writer_.reset();  // executes the job that was begun
  if (!engaged() || releasing_ || (!writing_ && persisted())) return;
  (void)execute({path_, text_, writing_ && writing_text_ == text_});
}

StopLatch::Step StopLatch::step(Stamp now) {
  if (Step ended = collect(now); ended.event != Step::Event::kNone) return ended;
  if (releasing_ && !path_.empty() && now >= release_until_) {
    releasing_ = false;
    return {Step::Event::kNotReleased, fmt::format("{} was not removed in time", path_)};
  }
  begin_job(now);
  return collect(now);
}

StopLatch::Step StopLatch::collect(Stamp now) {
  if (writing_) {
    const std::optional<Outcome> result = writer_->finished();
    if (!result) return {};
    writing_ = false;
    on_disk_known_ = result->ok();
    if (result->ok()) {
      on_disk_ = writing_text_;
    } else if (releasing_ && writing_text_.empty()) {
      releasing_ = false;
      return {Step::Event::kNotReleased, result->error().message};
    } else {
      next_try_ = now + kTryAgain;
      return {Step::Event::kNotWritten, result->error().message};
    }
  }
  const bool gone = path_.empty() || (on_disk_known_ && on_disk_.empty());
  if (!releasing_ || !gone) return {};
  for (const stop_t& s : stops_) released_.push_back(s.id);
  stops_.clear();
  damage_.clear();
  releasing_ = check_ = false;
  note_change();
  return {Step::Event::kReleased, ""};
}

void StopLatch::begin_job(Stamp now) {
  if (writing_ || path_.empty() || now < next_try_) return;
  const std::string& wanted = releasing_ ? std::string() : text_;
  const bool up_to_date = on_disk_known_ && on_disk_ == wanted;
  if (up_to_date && !check_) return;
  writing_ = true;
  writing_text_ = wanted;
  check_ = false;
  writer_->start({path_, wanted, up_to_date});
}

std::vector<std::int64_t> StopLatch::take_released() { return std::exchange(released_, {}); }

Result<std::string> state_folder(const ParamFile& file) {
  const Result<ProcessTables> tables = read_process_tables(file);
  if (!tables) return tables.error();
  const std::string& key = tables->state_directory;
  return key.empty() ? default_folder() : file.resolve(key);
}

Result<std::string> stop_latch_path(const ParamFile& file) {
  const Result<std::string> state = state_folder(file);
  if (!state) return state.error();
  const std::string& folder = *state;
  if (folder.empty()) {
    return Error{fmt::format(
        "{}: no folder to latch emergency stops in: set [process] state_directory, or one of "
        "STATE_DIRECTORY, XDG_STATE_HOME and HOME",
        file.name())};
  }
  // The folder of the configuration with links resolved, its name as given: a link that is set to
  // another version of the vehicle's configuration does not lose the vehicle's stop.
  std::error_code error;
  const fs::path given(file.name());
  const fs::path parent = fs::weakly_canonical(fs::absolute(given, error).parent_path(), error);
  const std::string config = (parent / given.filename()).string();
  const fs::path name = fmt::format("{}-{:016x}.stop", given.stem().string(), fnv1a(config));
  return (folder / name).string();
}

Result<StopLatch> open_stop_latch(const ParamFile& file) {
  const Result<std::string> path = stop_latch_path(file);
  if (!path) return path.error();
  Result<StopLatch> latch = StopLatch::open(*path);
  if (latch) return latch;
  return Error{
      fmt::format("{}; emergency stops are latched there: set [process] state_directory in {}",
                  latch.error().message, file.name())};
}

}  // namespace rcs
