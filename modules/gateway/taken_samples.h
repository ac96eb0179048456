#pragma once
// Samples on loan from DDS.

#include <dds/dds.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace rcs::gateway {

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
