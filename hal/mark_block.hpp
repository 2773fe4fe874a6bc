// What a controller draws for viewers: a fixed number of shapes in named frames.
// Layer: hal.  Thread: declared non-RT; the rest the loop's; look() any.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/seqlock.hpp"
#include "hal/robot.hpp"

namespace tandem::hal {

enum class MarkShape : std::uint8_t {
  kPoints,   ///< a ball at each point
  kArrow,    ///< from the first point to the second
  kLine,     ///< through the points
  kPolygon,  ///< the same, and back to the first
  kText,     ///< at the first point
};

/// How a mark looks, as it is declared.
struct MarkStyle {
  MarkShape shape = MarkShape::kPoints;
  std::string frame{};     ///< a link, or a site; "odom": the world, where a fixed base stands
  std::size_t points = 1;  ///< the most; an arrow has 2, a text 1
  double size_m = 0.02;    ///< diameter of balls and of an arrow's shaft, width of lines, height of
                           ///< letters
  std::array<float, 4> rgba{0.9F, 0.4F, 0.1F, 1.0F};  ///< each 0 to 1
};

/// One mark. Names are unique in a controller.
struct MarkInfo : MarkStyle {
  std::string name;
  std::size_t first = 0;  ///< of its points among the block's
  // Once the block is closed: what viewers know of the frame, which has no sites.
  std::string link{};               ///< or "odom"
  std::array<double, 3> xyz_m{};    ///< of the frame in that
  std::array<double, 3> rpy_rad{};  ///< the same, as of a Site
};

/// The marks of one controller. It stays where it is: handles point into it.
class MarkBlock {
 public:
  static constexpr std::size_t kMostMarks = 16, kMostPoints = 120, kLongestText = 60;

  /// What changes, as plain bytes.
  struct State {
    struct One {
      std::uint32_t points = 0;  ///< that are shown; 0: the mark is not
      std::array<char, kLongestText> text{};
    };
    std::int64_t time_ns = -1;  ///< of the last show_to_viewers(); -1: there was none
    std::uint64_t drawn = 0;    ///< 0: nothing is shown, whatever the marks say
    std::array<std::array<double, 3>, kMostPoints> place_m{};
    std::array<One, kMostMarks> marks{};
  };

  MarkBlock() = default;
  MarkBlock(const MarkBlock&) = delete;
  MarkBlock& operator=(const MarkBlock&) = delete;

  /// Index of a new mark; kMostMarks: there is no room, and check() says so.
  [[nodiscard]] std::size_t declare(std::string name, MarkStyle style);
  /// No more of them.
  /// @param links  the robot's; empty: not known, and any frame is one
  /// Errors, with the mark's name as key: a name twice, or one that cannot be shown; a frame that
  /// the robot lacks (with the nearest); no point; a size or colour out of range; more marks or
  /// points than there is room for.
  [[nodiscard]] Status close(std::span<const std::string> links, std::span<const Site> sites);

  [[nodiscard]] std::span<const MarkInfo> declared() const noexcept TANDEM_RT { return declared_; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept TANDEM_RT {
    return std::as_bytes(std::span(&state_, 1));
  }
  /// Shows the marks to look() and in bytes(). @param drawn  false: from now on there are none
  /// @return false: there were none before either @rt a store for each word
  bool show_to_viewers(std::int64_t time_ns, bool drawn) noexcept TANDEM_RT {
    if (shown_ == nullptr || (!drawn && state_.drawn == 0)) return false;
    state_.time_ns = time_ns;
    state_.drawn = drawn ? 1 : 0;
    shown_->write(std::span(&state_, 1));
    return true;
  }
  /// What was shown last. Any thread, once it is closed.
  [[nodiscard]] State look() const;

  /// Places point `point` of a mark, which shows it and those before it. @rt a store
  void place(std::size_t mark, std::size_t point,
             const std::array<double, 3>& at_m) noexcept TANDEM_RT {
    if (mark >= declared_.size() || point >= declared_[mark].points) return;
    state_.place_m[declared_[mark].first + point] = at_m;
    std::uint32_t& shown = state_.marks[mark].points;
    shown = std::max(shown, static_cast<std::uint32_t>(point + 1));
  }
  /// Shows the first `points`; 0 hides the mark. @rt a store
  void show(std::size_t mark, std::size_t points) noexcept TANDEM_RT {
    if (mark >= declared_.size()) return;
    state_.marks[mark].points =
        static_cast<std::uint32_t>(std::min(points, declared_[mark].points));
  }
  /// What a text mark says; cut after kLongestText bytes. @rt a copy
  void say(std::size_t mark, std::string_view text) noexcept TANDEM_RT {
    if (mark >= declared_.size()) return;
    auto& to = state_.marks[mark].text;
    to.fill('\0');
    std::copy_n(text.begin(), std::min(text.size(), to.size()), to.begin());
  }
  /// What is read is shown, too.
  void archive(Archive& ar) {
    if (declared_.empty()) return;
    ar.raw(&state_, sizeof state_);
    if (ar.reading() && shown_ != nullptr) shown_->write(std::span(&state_, 1));
  }

 private:
  std::vector<MarkInfo> declared_;
  std::size_t points_ = 0;
  std::string refused_;  // the first that found no room
  State state_;
  std::unique_ptr<Seqlock<State>> shown_;  // null: nothing is declared, or it is not closed
};

}  // namespace tandem::hal
