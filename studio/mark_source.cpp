#include "studio/mark_source.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "hal/marker.hpp"

namespace tandem::studio {

using hal::FieldType;
using hal::MarkShape;

const char* to_string(MarkShape shape) {
  switch (shape) {
    case MarkShape::kPoints: return "points";
    case MarkShape::kArrow: return "arrow";
    case MarkShape::kLine: return "line";
    case MarkShape::kPolygon: return "polygon";
    case MarkShape::kText: return "text";
  }
  return "?";
}

MarkSource::MarkSource(std::string controller, std::shared_ptr<const hal::MarkBlock> block)
    : controller_(std::move(controller)), block_(std::move(block)) {
  for (const hal::MarkInfo& mark : block_->declared()) {  // the widest numbers come first
    layout_.add(mark.name, FieldType::kF64, 3 * mark.points, "[m] places in " + mark.link);
  }
  for (const hal::MarkInfo& mark : block_->declared()) {
    layout_.add(mark.name + ".shown", FieldType::kU8, 1, "places that are shown");
    if (mark.shape != MarkShape::kText) continue;
    layout_.add(mark.name + ".text", FieldType::kU8, hal::MarkBlock::kLongestText, "its bytes");
  }
  image_.resize(layout_.bytes());
}

void MarkSource::look() {
  const hal::MarkBlock::State now = block_->look();
  const auto put = [&](const std::string& name, const void* from, std::size_t bytes) {
    std::memcpy(image_.data() + layout_.find(name)->offset, from, bytes);
  };
  std::size_t index = 0;
  for (const hal::MarkInfo& mark : block_->declared()) {
    const std::size_t i = index++;
    const bool there = hal::marker_of(mark, now, i).action == hal::Marker::kAdd;
    const auto shown = static_cast<std::uint8_t>(there ? now.marks[i].points : 0);
    put(mark.name, &now.place_m[mark.first], mark.points * sizeof now.place_m[0]);
    put(mark.name + ".shown", &shown, sizeof shown);
    if (mark.shape == MarkShape::kText)
      put(mark.name + ".text", now.marks[i].text.data(), now.marks[i].text.size());
  }
}

}  // namespace tandem::studio
