#pragma once
// Which samples of topic EmergencyStop are stored. DDS keeps an instance for each vehicle and
// operator_id for as long as its writer lives, and only the newest samples of each, of whatever
// writer: one that invents names would use up the memory and delay the samples of others, and one
// that uses the name of another operator would displace the samples of that one.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::gateway {

class StopAdmission {
 public:
  /// Operators in the samples of writers that are not known yet.
  static constexpr std::size_t kMaxOthers = 64;

  /// A writer that DDS has discovered.
  struct Writer {
    std::uint64_t handle = 0;
    std::string operator_id;  ///< that its permissions name; empty: none, or several
  };
  struct Sample {
    std::string_view vehicle;
    std::string_view operator_id;
    std::uint64_t writer = 0;  ///< its handle
    bool engage = true;
  };
  enum class Verdict {
    kStored,
    kUnnamedStop,  ///< not stored; it stops the vehicle as the stop of an unknown operator
    kDropped       ///< a release, or for another vehicle
  };

  /// @param vehicle  for which samples are stored
  explicit StopAdmission(std::string vehicle) : vehicle_(std::move(vehicle)) {}

  [[nodiscard]] Verdict judge(const Sample& sample);

  /// The writers that exist now. Those that are gone are remembered for a while: a program may
  /// write a stop and end.
  void set_writers(const std::vector<Writer>& writers);
  /// The operator of a writer; null: it is not known.
  [[nodiscard]] const std::string* operator_of(std::uint64_t writer) const;

  /// Whether a stop was not stored since the last call.
  [[nodiscard]] bool take_unnamed_stop() { return std::exchange(unnamed_stop_, false); }
  /// Whether a release in the name of another was not stored since the last call.
  [[nodiscard]] bool take_refused_release() { return std::exchange(refused_release_, false); }
  [[nodiscard]] std::int64_t not_stored() const { return not_stored_; }

 private:
  static constexpr std::size_t kMaxWriters = 512;

  std::string vehicle_;
  std::vector<Writer> writers_;  // the oldest first
  std::vector<std::string> others_;
  bool unnamed_stop_ = false;
  bool refused_release_ = false;
  std::int64_t not_stored_ = 0;
};

}  // namespace rcs::gateway
