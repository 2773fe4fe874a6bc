// What a controller says in words, from the cycle: fixed slots, and a flood is counted.
// Layer: controllers.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/text_event.hpp"

namespace tandem {

/// The host's part: what waits to be taken after the cycle. No heap.
class TextEventSlots {
 public:
  static constexpr std::size_t kSlots = 8;    ///< of one cycle
  static constexpr double kBurst = 50.0;      ///< at once,
  static constexpr double kPerSecond = 20.0;  ///< and again, of the run's time

  /// A slot to fill; null, and counted: there have been too many.
  [[nodiscard]] hal::TextEvent* begin(hal::TextLevel level) noexcept TANDEM_RT {
    if (waiting_ == kSlots || credit_ < 1.0) {
      ++left_out_;
      ++all_left_out_;
      return nullptr;
    }
    credit_ -= 1.0;
    hal::TextEvent& event = slots_[waiting_++];
    event = {};
    event.level = level;
    event.left_out = std::exchange(left_out_, 0);
    return &event;
  }
  /// What came since the last take(), which `seconds` have gone since.
  [[nodiscard]] std::span<hal::TextEvent> take(double seconds) noexcept TANDEM_RT {
    credit_ = std::min(kBurst, credit_ + kPerSecond * seconds);
    return std::span(slots_).first(std::exchange(waiting_, 0));
  }
  /// That were too many, so far.
  [[nodiscard]] std::uint64_t left_out() const noexcept { return all_left_out_; }
  /// The same since the last call.
  [[nodiscard]] std::uint64_t take_left_out() noexcept TANDEM_RT {
    return all_left_out_ - std::exchange(taken_left_out_, all_left_out_);
  }
  void archive(Archive& ar) { ar(credit_, left_out_, all_left_out_, taken_left_out_); }

 private:
  std::array<hal::TextEvent, kSlots> slots_{};
  std::size_t waiting_ = 0;
  double credit_ = kBurst;
  std::uint64_t left_out_ = 0, all_left_out_ = 0, taken_left_out_ = 0;
};

/// What ControllerSetup::text_events() gives: `log_("stance changed", foot)` is the line
/// "stance changed 1" in log, on /rosout and in the run's output. Words, integers, numbers (six
/// digits) and truth values are put together with blanks; what is longer than 160 characters is
/// cut. 50 lines at once and 20 a second are kept, at most 8 of a cycle; others are counted, and
/// the next line says how many. @rt no heap, no lock, no system call.
class TextEvents {
 public:
  TextEvents() = default;
  explicit TextEvents(std::shared_ptr<TextEventSlots> slots) : slots_(std::move(slots)) {}

  template <class... Parts>
  void operator()(std::string_view words, const Parts&... parts) const noexcept TANDEM_RT {
    write(hal::TextLevel::kInfo, words, parts...);
  }
  /// The same as a warning.
  template <class... Parts>
  void warn(std::string_view words, const Parts&... parts) const noexcept TANDEM_RT {
    write(hal::TextLevel::kWarn, words, parts...);
  }

 private:
  template <class... Parts>
  void write(hal::TextLevel level, std::string_view words,
             const Parts&... parts) const noexcept TANDEM_RT {
    hal::TextEvent* const event = slots_ == nullptr ? nullptr : slots_->begin(level);
    if (event == nullptr) return;
    event->append(words);
    (append(*event, parts), ...);
  }
  template <class Part>
  static void append(hal::TextEvent& event, const Part& part) noexcept TANDEM_RT {
    event.append(" ");
    if constexpr (std::same_as<Part, bool>) {
      event.append(part ? "true" : "false");
    } else if constexpr (std::floating_point<Part>) {
      append_number(event, static_cast<double>(part), std::chars_format::general, 6);
    } else if constexpr (std::integral<Part>) {
      append_number(event, static_cast<std::int64_t>(part));
    } else {
      event.append(std::string_view(part));
    }
  }
  template <class Number, class... How>
  static void append_number(hal::TextEvent& event, Number number, How... how) noexcept TANDEM_RT {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number, how...);
    event.append({digits.data(), static_cast<std::size_t>(end.ptr - digits.data())});
  }

  std::shared_ptr<TextEventSlots> slots_;
};

}  // namespace tandem
