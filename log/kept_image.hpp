// What a log keeps of an image: every n-th cycle, and of it the fields that are wanted.
// Layer: log.  Thread: made non-RT; the rest the recorder's.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/image.hpp"
#include "log/bytes.hpp"

namespace tandem::log {

/// How much of the topics of a name is logged.
struct TopicShare {
  std::string name;         ///< "state": of /tandem/state and of /tandem/parallel/state
  std::uint32_t every = 1;  ///< cycles whose number is a multiple of it; 0: the topic is left out
  std::vector<std::string> without{};  ///< fields, by their names in the log
};

/// The share of a topic; one that none names is kept as a whole.
[[nodiscard]] TopicShare share_of(std::span<const TopicShare> shares, std::string_view topic);

/// One topic's images, cut to what is kept.
class KeptImage {
 public:
  /// @pre the first field is the cycle's number, and stays
  KeptImage(const hal::Layout& whole, const TopicShare& share);

  [[nodiscard]] const hal::Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint32_t every() const { return every_; }
  /// Whether the image of this cycle is kept.
  [[nodiscard]] bool takes(std::span<const std::byte> image) const;
  /// The bytes that are kept, of layout(). Valid until the next call.
  [[nodiscard]] std::span<const std::byte> cut(std::span<const std::byte> image);

 private:
  struct Run {  // of bytes that stay together
    std::size_t offset, bytes;
  };
  hal::Layout layout_;
  std::uint32_t every_;
  bool whole_;  // nothing is left out
  std::vector<Run> runs_;
  Bytes cut_;  // reused
};

}  // namespace tandem::log
