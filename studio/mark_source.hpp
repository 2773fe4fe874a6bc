// The marks of a controller as a source: places and words as numbers, beside how they look.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/image.hpp"
#include "hal/mark_block.hpp"

namespace tandem::studio {

/// The marks of one controller. The image has the newest look: marks are drawn for people, not for
/// a log.
class MarkSource {
 public:
  MarkSource(std::string controller, std::shared_ptr<const hal::MarkBlock> block);

  [[nodiscard]] const std::string& controller() const { return controller_; }
  [[nodiscard]] const hal::MarkBlock* block() const { return block_.get(); }
  /// By mark NAME: its places (x, y, z each); `NAME.shown`, how many of them are; of a text
  /// `NAME.text`, its bytes.
  [[nodiscard]] const hal::Layout& layout() const { return layout_; }
  /// Takes what the controller has drawn since.
  void look();
  /// What look() took, by layout().
  [[nodiscard]] std::span<const std::byte> image() const { return image_; }

  std::size_t source = 0;  ///< in the table of signals

 private:
  std::string controller_;
  std::shared_ptr<const hal::MarkBlock> block_;
  hal::Layout layout_;
  std::vector<std::byte> image_;
};

/// "arrow": of the messages.
[[nodiscard]] const char* to_string(hal::MarkShape shape);

}  // namespace tandem::studio
