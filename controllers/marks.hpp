// What a controller draws for viewers (RViz, Foxglove): what it holds of a mark.
// Layer: controllers.  Thread: declared in configure(); written RT.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string_view>
#include <utility>

#include "base/realtime.hpp"
#include "hal/mark_block.hpp"

namespace tandem {

/// A mark that ControllerSetup declared: `push_.set(0, at); push_.set(1, tip)`. It is not shown
/// before its first point is set; what is shown stays until it is changed. Beyond its points
/// nothing happens. It cannot dangle.
class Mark {
 public:
  Mark() = default;
  /// ControllerSetup's.
  Mark(std::shared_ptr<hal::MarkBlock> block, std::size_t mark)
      : block_(std::move(block)), mark_(mark) {}

  /// Places a point [m, in the mark's frame]; it and those before it are shown from now on.
  void set(std::size_t point, const std::array<double, 3>& at_m) noexcept TANDEM_RT {
    if (block_ != nullptr) block_->place(mark_, point, at_m);
  }
  /// Shows the first `points`.
  void show(std::size_t points) noexcept TANDEM_RT {
    if (block_ != nullptr) block_->show(mark_, points);
  }
  void hide() noexcept TANDEM_RT { show(0); }
  /// What a text says, 60 bytes at most.
  void say(std::string_view text) noexcept TANDEM_RT {
    if (block_ != nullptr) block_->say(mark_, text);
  }

 private:
  std::shared_ptr<hal::MarkBlock> block_;
  std::size_t mark_ = 0;
};

}  // namespace tandem
