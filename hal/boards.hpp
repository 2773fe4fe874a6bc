// What an emulation's boards and drives are in at a step, beside the plant's truth: an image of its
// own, for the studio of `tandem emulate`.
// Layer: hal.  Thread: as the images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/image.hpp"

namespace tandem::hal {

/// The accessors of hal/boards_fields.inc: joints and buses in the robot's order.
class BoardsImage : public Image {
#define TANDEM_FIELD TANDEM_IMAGE_MEMBERS
#include "hal/boards_fields.inc"
#undef TANDEM_FIELD

 public:
  BoardsImage(std::size_t joints, std::size_t buses);

  [[nodiscard]] std::size_t joints() const noexcept { return current_A_.count; }
  [[nodiscard]] std::size_t buses() const noexcept { return wire_load_.count; }
};

}  // namespace tandem::hal
