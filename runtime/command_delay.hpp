// A declared delay of whole cycles between the controllers and the limits.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

/// What goes in comes out so many cycles later, the same to the last bit.
class CommandDelay {
 public:
  CommandDelay(const hal::ImageShape& shape, std::uint32_t cycles)
      : line_(cycles, hal::CommandImage(shape)), before_(shape) {}

  [[nodiscard]] bool on() const noexcept { return !line_.empty(); }
  /// `command` comes out until what goes in from now on does.
  void fill(const hal::CommandImage& command) noexcept TANDEM_RT {
    for (hal::CommandImage& one : line_) one.assign(command);
    before_.assign(command);
    next_ = 0;
  }
  /// One cycle. @pre on(); `in` and `out` are not the same.
  void pass(const hal::CommandImage& in, hal::CommandImage& out) noexcept TANDEM_RT {
    before_.assign(out);
    out.assign(line_[next_]);
    line_[next_].assign(in);
    next_ = next_ + 1 == line_.size() ? 0 : next_ + 1;
  }
  /// What `out` was before the last pass(): the command that was sent in the cycle before.
  [[nodiscard]] const hal::CommandImage& before() const noexcept { return before_; }
  void archive(Archive& ar) { ar(line_, next_, before_); }

 private:
  std::vector<hal::CommandImage> line_;  // a ring
  std::uint64_t next_ = 0;               // the oldest
  hal::CommandImage before_;
};

}  // namespace tandem::runtime
