#pragma once
// DDS handles that are released automatically.

#include <dds/dds.h>

#include <memory>
#include <utility>

namespace rcs::dds {

/// An entity; deleting it deletes all entities below it.
class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) : handle_(handle) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Entity() {
    if (handle_ > 0) (void)dds_delete(handle_);
  }

  [[nodiscard]] bool valid() const { return handle_ > 0; }
  /// Negative: the error code.
  [[nodiscard]] dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

struct DeleteQos {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

inline Qos make_qos() { return Qos(dds_create_qos()); }

}  // namespace rcs::dds
