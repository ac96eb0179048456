#pragma once
// DDS handles that are released automatically.

#include <dds/dds.h>

#include <array>
#include <utility>

namespace rcs::gateway {

/// An entity; deleting it deletes all entities below it.
class DdsEntity {
 public:
  DdsEntity() = default;
  explicit DdsEntity(dds_entity_t handle) : handle_(handle) {}
  DdsEntity(DdsEntity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  DdsEntity& operator=(DdsEntity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~DdsEntity() {
    if (handle_ > 0) (void)dds_delete(handle_);
  }

  [[nodiscard]] bool valid() const { return handle_ > 0; }
  /// Negative: the error code.
  [[nodiscard]] dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

/// Up to N samples of type T, taken from a reader on loan. Never blocks.
template <class T, std::size_t N>
class TakenSamples {
 public:
  explicit TakenSamples(dds_entity_t reader) : reader_(reader) {
    const dds_return_t n = dds_take(reader, samples_.data(), infos_.data(), N, N);
    count_ = n > 0 ? static_cast<std::size_t>(n) : 0;
  }
  TakenSamples(const TakenSamples&) = delete;
  TakenSamples& operator=(const TakenSamples&) = delete;
  ~TakenSamples() {
    if (samples_[0] != nullptr) {
      (void)dds_return_loan(reader_, samples_.data(), static_cast<std::int32_t>(count_));
    }
  }

  [[nodiscard]] std::size_t size() const { return count_; }
  /// Null: no data; the sample reports a change of a writer.
  [[nodiscard]] const T* data(std::size_t i) const {
    return infos_[i].valid_data ? static_cast<const T*>(samples_[i]) : nullptr;
  }
  [[nodiscard]] dds_instance_handle_t writer(std::size_t i) const {
    return infos_[i].publication_handle;
  }

 private:
  dds_entity_t reader_;
  std::array<void*, N> samples_{};
  std::array<dds_sample_info_t, N> infos_{};
  std::size_t count_ = 0;
};

}  // namespace rcs::gateway
