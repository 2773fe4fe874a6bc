// Fields keep their order, so what is left has no padding either.
#include "log/kept_image.hpp"

#include <algorithm>
#include <cstring>

namespace tandem::log {

TopicShare share_of(std::span<const TopicShare> shares, std::string_view topic) {
  const std::string_view name = topic.substr(topic.rfind('/') + 1);
  const auto found = std::ranges::find(shares, name, &TopicShare::name);
  return found == shares.end() ? TopicShare{.name = std::string(name)} : *found;
}

KeptImage::KeptImage(const hal::Layout& whole, const TopicShare& share) : every_(share.every) {
  for (const hal::Field& field : whole.fields()) {
    if (std::ranges::find(share.without, field.name) != share.without.end()) continue;
    const std::size_t bytes = field.count * hal::size_of(field.type);
    layout_.add(field.name, field.type, field.count, field.doc);
    if (!runs_.empty() && runs_.back().offset + runs_.back().bytes == field.offset) {
      runs_.back().bytes += bytes;
    } else {
      runs_.push_back({field.offset, bytes});
    }
  }
  whole_ = layout_.bytes() == whole.bytes();
  cut_.resize(layout_.bytes());
}

bool KeptImage::takes(std::span<const std::byte> image) const {
  if (every_ <= 1) return every_ == 1;
  std::uint64_t cycle = 0;
  std::memcpy(&cycle, image.data(), sizeof cycle);
  return cycle % every_ == 0;
}

std::span<const std::byte> KeptImage::cut(std::span<const std::byte> image) {
  if (whole_) return image;
  std::byte* to = cut_.data();
  for (const Run& run : runs_) to = std::ranges::copy(image.subspan(run.offset, run.bytes), to).out;
  return cut_;
}

}  // namespace tandem::log
