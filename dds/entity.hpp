// A DDS entity that is deleted with its owner.
// Layer: dds.  Thread: any, non-RT: no DDS call is fit for the real-time thread.
#pragma once

#include <dds/dds.h>

#include <string>
#include <utility>

#include "base/result.hpp"

namespace tandem::dds {

class Entity {
 public:
  Entity() = default;
  explicit Entity(dds_entity_t handle) noexcept : handle_(handle) {}
  ~Entity() {
    if (handle_ > 0) dds_delete(handle_);
  }
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }

  /// Below 1: none, or the error's code.
  [[nodiscard]] dds_entity_t get() const noexcept { return handle_; }
  [[nodiscard]] bool ok() const noexcept { return handle_ > 0; }

 private:
  dds_entity_t handle_ = 0;
};

/// A call of Cyclone DDS that failed: "cannot make the topic rt/tf: Out Of Resources".
[[nodiscard]] inline Error dds_error(const std::string& what, dds_return_t code,
                                     std::string hint = {}) {
  return {.message = "cannot " + what + ": " + dds_strretcode(code),
          .hint = std::move(hint),
          .file = {},
          .key = {}};
}

}  // namespace tandem::dds
