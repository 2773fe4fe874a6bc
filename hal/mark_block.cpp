#include "hal/mark_block.hpp"

#include "base/file_name.hpp"

namespace tandem::hal {

std::size_t MarkBlock::declare(std::string name, MarkStyle style) {
  if (style.shape == MarkShape::kArrow) style.points = 2;
  if (style.shape == MarkShape::kText) style.points = 1;
  const bool room = declared_.size() < kMostMarks && style.points <= kMostPoints - points_;
  if (!room || !refused_.empty()) {
    if (refused_.empty()) refused_ = std::move(name);
    return kMostMarks;
  }
  MarkInfo& made = declared_.emplace_back();
  static_cast<MarkStyle&>(made) = std::move(style);
  made.name = std::move(name);
  made.first = points_;
  points_ += made.points;
  return declared_.size() - 1;
}

Status MarkBlock::check() const {
  for (const MarkInfo& one : declared_) {
    if (const std::string problem = shown_name_problem(one.name); !problem.empty())
      return fail_at(one.name, "its name " + problem, "give the mark another name");
    if (std::ranges::count(declared_, one.name, &MarkInfo::name) > 1)
      return fail_at(one.name, "is declared twice", "give each mark its own name");
    if (!shown_name_problem(one.frame).empty())
      return fail_at(one.name, "has no frame", "name a link, or \"odom\"");
    if (one.points == 0) return fail_at(one.name, "has no point", "declare at least one");
    const auto share = [](float value) { return value >= 0.0F && value <= 1.0F; };
    if (!(one.size_m > 0.0 && one.size_m <= 1000.0) || !std::ranges::all_of(one.rgba, share)) {
      return fail_at(one.name, "has a size or a colour that is out of range",
                     "a size is above 0 and at most 1000 m, each part of a colour from 0 to 1");
    }
  }
  if (refused_.empty()) return {};
  return fail_at(refused_, "is more than there is room for",
                 "a controller has at most " + std::to_string(kMostMarks) + " marks with " +
                     std::to_string(kMostPoints) + " points together");
}

}  // namespace tandem::hal
