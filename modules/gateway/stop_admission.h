#pragma once
// Which samples of topic EmergencyStop are stored. DDS keeps an instance for each operator_id for
// as long as its writer lives: a writer that invents operators would use up the memory, and its
// samples would delay those of others.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rcs::gateway {

class StopAdmission {
 public:
  /// Operators that are no writer's: its discovery may not have ended.
  static constexpr std::size_t kMaxOthers = 64;

  enum class Verdict {
    kStored,
    kUnnamedStop,  ///< not stored; it stops the vehicle as the stop of an unknown operator
    kDropped       ///< a release
  };
  [[nodiscard]] Verdict judge(std::string_view operator_id, bool engage);

  /// Operators of the writers that exist now.
  void set_writers(std::vector<std::string> operators) { writers_ = std::move(operators); }

  /// Whether a stop was not stored since the last call.
  [[nodiscard]] bool take_unnamed_stop();
  [[nodiscard]] std::int64_t not_stored() const { return not_stored_; }

 private:
  std::vector<std::string> writers_;
  std::vector<std::string> others_;
  bool unnamed_stop_ = false;
  std::int64_t not_stored_ = 0;
};

}  // namespace rcs::gateway
