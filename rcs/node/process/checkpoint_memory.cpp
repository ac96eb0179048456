#include "rcs/node/process/checkpoint_memory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <system_error>

#include "rcs/node/bus/publisher.h"

namespace rcs {
namespace {

constexpr std::uint64_t kMagic = 0x52435343'48504b31;

/// A record is complete if both counters are equal and not zero: the writer sets `begun`, then the
/// content, then `ended`. Stores of a killed process stay in the memory in their order.
struct Mark {
  std::atomic<std::uint64_t> begun;
  std::atomic<std::uint64_t> ended;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

struct Header {
  std::uint64_t magic;
  std::uint64_t program;
  std::uint64_t state_bytes, rows, row_bytes;
  std::uint64_t unused[3];
};

constexpr std::size_t kAlign = 64;
std::size_t aligned(std::size_t bytes) { return (bytes + kAlign - 1) / kAlign * kAlign; }
std::size_t record_bytes(std::size_t content) { return kAlign + aligned(content); }

constexpr std::size_t kStates = 2;  // the newest complete one survives the writing of the next

std::size_t total_bytes(const CheckpointLayout& l) {
  return sizeof(Header) + kStates * record_bytes(l.state_bytes) +
         l.rows * record_bytes(l.row_bytes);
}

std::byte* state_at(std::byte* mapped, const CheckpointLayout& l, std::size_t k) {
  return mapped + sizeof(Header) + k * record_bytes(l.state_bytes);
}
std::byte* row_at(std::byte* mapped, const CheckpointLayout& l, std::size_t k) {
  return state_at(mapped, l, kStates) + k * record_bytes(l.row_bytes);
}

Mark& mark_of(std::byte* record) { return *reinterpret_cast<Mark*>(record); }

std::uint64_t generation(std::byte* record) {
  const Mark& m = mark_of(record);
  const std::uint64_t ended = m.ended.load();
  return m.begun.load() == ended ? ended : 0;
}

void write_record(std::byte* record, const void* content, std::size_t bytes, std::uint64_t number) {
  Mark& m = mark_of(record);
  m.begun.store(number);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  std::memcpy(record + kAlign, content, bytes);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  m.ended.store(number);
}

/// Of the program file: a successor of another version may interpret the bytes differently.
std::uint64_t this_program() {
  struct stat status {};
  if (stat("/proc/self/exe", &status) != 0) return 0;
  std::uint64_t id = 14695981039346656037ULL;
  const auto add = [&id](std::int64_t value) {
    id = (id ^ static_cast<std::uint64_t>(value)) * 1099511628211ULL;
  };
  add(static_cast<std::int64_t>(status.st_ino));
  add(static_cast<std::int64_t>(status.st_size));
  add(status.st_mtim.tv_sec);
  add(status.st_mtim.tv_nsec);
  return id;
}

FileHandle open_file(const std::string& path, int flags) {
  return FileHandle(
      ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | flags, 0600));
}

/// The files of vehicles that were not run again.
/// @param now_s  clock of the file system
void remove_outdated(const std::string& folder, const std::string& prefix, std::time_t now_s) {
  namespace fs = std::filesystem;
  std::error_code error;
  for (fs::directory_iterator i(folder, error); !error && i != fs::directory_iterator();
       i.increment(error)) {
    if (i->path().filename().string().rfind(prefix, 0) != 0) continue;
    const FileHandle file = open_file(i->path().string(), 0);
    struct stat status {};
    if (!file.valid() || fstat(file.get(), &status) != 0) continue;
    const auto age_s = static_cast<double>(now_s - status.st_mtim.tv_sec);
    const bool outdated = from_seconds(age_s) > kCheckpointOutdated;
    if (outdated && flock(file.get(), LOCK_EX | LOCK_NB) == 0) (void)unlink(i->path().c_str());
  }
}

}  // namespace

Result<std::unique_ptr<CheckpointMemory>> CheckpointMemory::of_this_process(
    const CheckpointLayout& layout, std::int64_t config_id) {
  const char* path = std::getenv(kCheckpointVariable);  // NOLINT(concurrency-mt-unsafe)
  if (path == nullptr || *path == '\0') return std::unique_ptr<CheckpointMemory>();
  return open(path, layout, this_program() ^ static_cast<std::uint64_t>(config_id));
}

Result<std::unique_ptr<CheckpointMemory>> CheckpointMemory::open(const std::string& path,
                                                                 const CheckpointLayout& layout,
                                                                 std::uint64_t program) {
  const auto failed = [&path](const char* what) {
    return Error{fmt::format("{}: {}: {}", path, what, std::generic_category().message(errno))};
  };
  FileHandle file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.valid()) return failed("cannot open the checkpoint memory");
  const std::size_t bytes = total_bytes(layout);
  // A page that the file system has no room for would end the process when it is written.
  errno = posix_fallocate(file.get(), 0, static_cast<off_t>(bytes));
  if (errno != 0) return failed("no room for the checkpoint memory");
  void* const mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (mapped == MAP_FAILED) return failed("cannot map");
  std::unique_ptr<CheckpointMemory> memory(
      new CheckpointMemory(std::move(file), static_cast<std::byte*>(mapped), layout));
  Header& header = *reinterpret_cast<Header*>(memory->mapped_);
  const CheckpointLayout found{header.state_bytes, header.rows, header.row_bytes};
  if (header.magic != kMagic || header.program != program || !(found == layout)) {
    header.magic = 0;
    memory->clear();
    header = {0, program, layout.state_bytes, layout.rows, layout.row_bytes, {}};
    std::atomic_thread_fence(std::memory_order_seq_cst);
    header.magic = kMagic;
  }
  return memory;
}

CheckpointMemory::~CheckpointMemory() { (void)munmap(mapped_, total_bytes(layout_)); }

void CheckpointMemory::clear() {
  const auto invalidate = [](std::byte* record) {
    mark_of(record).begun.store(0);
    mark_of(record).ended.store(0);
  };
  for (std::size_t k = 0; k < kStates; ++k) invalidate(state_at(mapped_, layout_, k));
  for (std::size_t k = 0; k < layout_.rows; ++k) invalidate(row_at(mapped_, layout_, k));
}

void CheckpointMemory::write_state(const void* state) {
  const std::uint64_t first = generation(state_at(mapped_, layout_, 0));
  const std::uint64_t second = generation(state_at(mapped_, layout_, 1));
  const std::size_t older = first <= second ? 0 : 1;
  write_record(state_at(mapped_, layout_, older), state, layout_.state_bytes,
               std::max(first, second) + 1);
}

bool CheckpointMemory::read_state(void* state) const {
  const std::uint64_t first = generation(state_at(mapped_, layout_, 0));
  const std::uint64_t second = generation(state_at(mapped_, layout_, 1));
  if (first == 0 && second == 0) return false;
  std::memcpy(state, state_at(mapped_, layout_, first > second ? 0 : 1) + kAlign,
              layout_.state_bytes);
  return true;
}

void CheckpointMemory::write_row(std::size_t k, const void* row) {
  std::byte* const record = row_at(mapped_, layout_, k);
  write_record(record, row, layout_.row_bytes, mark_of(record).begun.load() + 1);
}

bool CheckpointMemory::read_row(std::size_t k, void* row) const {
  std::byte* const record = row_at(mapped_, layout_, k);
  if (generation(record) == 0) return false;
  std::memcpy(row, record + kAlign, layout_.row_bytes);
  return true;
}

Result<CheckpointOwner> CheckpointOwner::create() {
  CheckpointOwner owner;
  owner.file_ = FileHandle(memfd_create("rcs checkpoint", MFD_CLOEXEC));
  if (owner.file_.valid()) return owner;
  return Error{fmt::format("cannot create the checkpoint memory: {}",
                           std::generic_category().message(errno))};
}

Result<CheckpointOwner> CheckpointOwner::open(const std::string& folder,
                                              const std::string& vehicle) {
  const std::string prefix = fmt::format("rcs-checkpoint-{}-", geteuid());
  const std::string path = fmt::format("{}/{}{:016x}", folder, prefix, id_of(vehicle));
  CheckpointOwner owner;
  owner.file_ = open_file(path, O_CREAT);
  struct stat status {};
  if (!owner.file_.valid()) {
    return Error{fmt::format("cannot open the checkpoint memory {}: {}", path,
                             std::generic_category().message(errno))};
  }
  // Anyone can create a file in /dev/shm.
  const bool own = fstat(owner.file_.get(), &status) == 0 && S_ISREG(status.st_mode) &&
                   status.st_uid == geteuid() && (status.st_mode & 0077) == 0 &&
                   status.st_nlink == 1;
  if (!own) {
    return Error{fmt::format("{} is not a regular file of this user alone: remove it", path)};
  }
  if (flock(owner.file_.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{fmt::format("{} belongs to another `rcs up` of the same configuration", path)};
  }
  owner.keep();
  if (fstat(owner.file_.get(), &status) == 0) {
    remove_outdated(folder, prefix, status.st_mtim.tv_sec);
  }
  return owner;
}

void CheckpointOwner::keep() const { (void)futimens(file_.get(), nullptr); }

std::string CheckpointOwner::path() const {
  return fmt::format("/proc/{}/fd/{}", getpid(), file_.get());
}

std::string checkpoint_folder() {
  const char* const folder = std::getenv("RUNTIME_DIRECTORY");  // NOLINT(concurrency-mt-unsafe)
  const std::string given = folder == nullptr ? "" : folder;
  return given.empty() ? "/dev/shm" : given.substr(0, given.find(':'));  // as systemd writes them
}

}  // namespace rcs
