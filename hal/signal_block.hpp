// Numbers that a controller tells beside its command: a fixed block with a table of what they are.
// Layer: hal.  Thread: declared non-RT; written by the loop's; read() any.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/seqlock.hpp"
#include "hal/image.hpp"

namespace tandem::hal {

/// One signal, as it was declared.
struct SignalInfo {
  std::string name;       ///< "depth"
  std::string unit;       ///< "m"; empty: it has none
  std::string doc;        ///< one line
  std::size_t first = 0;  ///< of its numbers among the block's
  std::size_t count = 1;
  bool by_joint = false;  ///< a number for each joint, in the image's order
};

/// The signals of one controller. It stays where it is: handles point into it.
class SignalBlock {
 public:
  static constexpr std::size_t kMostNumbers = 500;

  SignalBlock() { words_.fill(std::numeric_limits<double>::quiet_NaN()); }
  SignalBlock(const SignalBlock&) = delete;
  SignalBlock& operator=(const SignalBlock&) = delete;

  // When the controller is configured.

  /// The place of the numbers of a new signal; null: there is no room, and close() says so.
  [[nodiscard]] double* declare(std::string name, std::string unit, std::string doc,
                                std::size_t count, bool by_joint = false) {
    if (!refused_.empty()) return nullptr;
    if (count == 0 || count > kMostNumbers - numbers_) {
      refused_ = std::move(name);
      refused_count_ = count;
      return nullptr;
    }
    declared_.push_back(
        {std::move(name), std::move(unit), std::move(doc), numbers_, count, by_joint});
    numbers_ += count;
    return words_.data() + kHead + declared_.back().first;
  }
  /// No more of them.
  /// Errors, with the signal's name as key: a name twice, or one that ROS 2 allows no field; a unit
  /// or line that cannot be shown; none of its numbers; more than kMostNumbers together.
  [[nodiscard]] Status close();

  // Any thread, once it is closed.

  [[nodiscard]] std::span<const SignalInfo> declared() const noexcept { return declared_; }
  [[nodiscard]] std::size_t numbers() const noexcept { return numbers_; }
  /// The layout of image(): cycle, time_ns, then every signal as a field; its doc begins with the
  /// unit in brackets.
  [[nodiscard]] Layout layout() const;
  /// "depth", "error.LKneeSag", "com.2": of each number.
  [[nodiscard]] std::vector<std::string> number_names(std::span<const std::string> joints) const;
  /// What publish() showed last.
  struct Look {
    std::uint64_t cycle = 0;
    std::int64_t time_ns = -1;  ///< -1: nothing yet
    std::vector<double> values;
  };
  [[nodiscard]] Look look() const;

  // The loop's.

  /// Shows the numbers to look(), as those of that cycle. @rt wait-free: a store a number.
  void publish(std::uint64_t cycle, std::int64_t time_ns) noexcept TANDEM_RT {
    words_[0] = std::bit_cast<double>(cycle);
    words_[1] = std::bit_cast<double>(time_ns);
    shown_->write(words());
  }
  /// What publish() showed, by layout().
  [[nodiscard]] std::span<const std::byte> image() const noexcept TANDEM_RT {
    return std::as_bytes(words());
  }
  /// A signal keeps its number until another is written. What is read is shown, too: nobody sees
  /// the numbers of another future.
  void archive(Archive& ar) {
    ar.raw(words_.data(), words().size_bytes());
    if (ar.reading() && shown_ != nullptr) shown_->write(words());
  }

 private:
  static constexpr std::size_t kHead = 2;
  [[nodiscard]] std::span<const double> words() const noexcept TANDEM_RT {
    return std::span(words_).first(kHead + numbers_);
  }

  std::vector<SignalInfo> declared_;
  std::size_t numbers_ = 0;
  std::string refused_;  // the first that found no room
  std::size_t refused_count_ = 0;
  std::array<double, kHead + kMostNumbers> words_;
  std::unique_ptr<Seqlock<double>> shown_;  // of words()
};

}  // namespace tandem::hal
