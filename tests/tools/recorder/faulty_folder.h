#pragma once
// A folder in memory with the faults of a disk: a power failure keeps only what was synced, any
// write can find the disk full, and every call can take time.

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rcs/base/stamp.h"
#include "tools/recorder/folder.h"

namespace rcs::test {

class FaultyFolder final : public recorder::Folder {
 public:
  struct File {
    std::vector<std::uint8_t> bytes;
    std::size_t synced_bytes = 0;
    bool synced_name = false;
  };
  using Files = std::map<std::string, File>;

  Files files;
  std::int64_t capacity = std::numeric_limits<std::int64_t>::max() / 2;
  std::int64_t used_by_others = 0;
  Stamp now;
  Duration write_time{};
  Duration sync_time{};
  /// Before and after every call that changes something.
  std::function<void()> at_every_instant = [] {};
  std::function<int()> write_error = [] { return 0; };
  std::function<int()> sync_error = [] { return 0; };

  /// What is on the disk after a power failure.
  /// @param unsynced_share  of the bytes that were written and not synced: a disk may keep a part
  [[nodiscard]] Files after_power_failure(double unsynced_share) const {
    Files kept;
    for (const auto& [name, file] : files) {
      if (!file.synced_name) continue;
      File& f = kept[name];
      f = file;
      const auto unsynced = static_cast<double>(file.bytes.size() - file.synced_bytes);
      f.bytes.resize(file.synced_bytes + static_cast<std::size_t>(unsynced_share * unsynced));
    }
    return kept;
  }
  [[nodiscard]] std::int64_t bytes() const {
    std::int64_t sum = 0;
    for (const auto& [name, file] : files) sum += static_cast<std::int64_t>(file.bytes.size());
    return sum;
  }

  [[nodiscard]] int list(std::vector<recorder::FolderEntry>* entries) override {
    entries->clear();
    for (const auto& [name, file] : files) {
      entries->push_back({name, static_cast<std::int64_t>(file.bytes.size())});
    }
    return 0;
  }
  [[nodiscard]] int create(const std::string& name,
                           std::unique_ptr<recorder::AppendFile>* file) override {
    const Instant instant(this, Duration::zero());
    if (files.count(name) != 0) return EEXIST;
    if (const int error = write_error(); error != 0) return error;
    files[name] = {};
    *file = std::make_unique<Appender>(this, name);
    return 0;
  }
  [[nodiscard]] int remove(const std::string& name) override {
    const Instant instant(this, Duration::zero());
    return files.erase(name) == 1 ? 0 : ENOENT;
  }
  [[nodiscard]] int sync() override {
    const Instant instant(this, sync_time);
    if (const int error = sync_error(); error != 0) return error;
    for (auto& [name, file] : files) file.synced_name = true;
    return 0;
  }
  [[nodiscard]] std::int64_t free_bytes() override { return capacity - used_by_others - bytes(); }

 private:
  /// One call: takes its time, with an instant before and after it.
  class Instant {
   public:
    Instant(FaultyFolder* folder, Duration time) : folder_(folder) {
      folder_->at_every_instant();
      folder_->now += time;
      folder_->at_every_instant();
    }
    Instant(const Instant&) = delete;
    Instant& operator=(const Instant&) = delete;
    ~Instant() { folder_->at_every_instant(); }

   private:
    FaultyFolder* folder_;
  };

  class Appender final : public recorder::AppendFile {
   public:
    Appender(FaultyFolder* folder, std::string name) : folder_(folder), name_(std::move(name)) {}

    /// A disk that becomes full first stores a part.
    [[nodiscard]] int append(const std::uint8_t* data, std::size_t size,
                             std::size_t* written) override {
      const Instant instant(folder_, folder_->write_time);
      *written = 0;
      if (const int error = folder_->write_error(); error != 0) return error;
      const std::int64_t free = folder_->free_bytes();
      if (free <= 0) return ENOSPC;
      *written = std::min(size, static_cast<std::size_t>(free));
      std::vector<std::uint8_t>& bytes = folder_->files[name_].bytes;
      bytes.insert(bytes.end(), data, data + *written);
      return 0;
    }
    [[nodiscard]] int sync() override {
      File& file = folder_->files[name_];
      const std::size_t begun = file.bytes.size();
      const Instant instant(folder_, folder_->sync_time);
      if (const int error = folder_->sync_error(); error != 0) return error;
      file.synced_bytes = begun;
      return 0;
    }

   private:
    FaultyFolder* folder_;
    std::string name_;
  };
};

}  // namespace rcs::test
