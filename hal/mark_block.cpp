#include "hal/mark_block.hpp"

#include "base/file_name.hpp"
#include "base/nearest.hpp"

namespace tandem::hal {
namespace {

constexpr const char* kWorld = "odom";

/// Where the mark's frame is, by what viewers know: links and the world.
Status place_frame(MarkInfo& mark, std::span<const std::string> links,
                   std::span<const Site> sites) {
  mark.link = mark.frame;
  const bool is_link = std::ranges::find(links, mark.frame) != links.end();
  if (is_link || mark.frame == kWorld) return {};
  const auto site = std::ranges::find(sites, mark.frame, &Site::name);
  if (site != sites.end()) {
    mark.link = site->link;
    mark.xyz_m = site->xyz_m;
    mark.rpy_rad = site->rpy_rad;
    return {};
  }
  if (links.empty()) return {};
  std::vector<std::string> known{kWorld};
  for (const Site& one : sites) known.push_back(one.name);
  known.insert(known.end(), links.begin(), links.end());
  return fail_at(mark.name,
                 "is in the frame '" + mark.frame + "', which is no link or site of the robot",
                 mark.frame == "world" ? "the world is \"odom\"" : suggest(mark.frame, known));
}

}  // namespace

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

Status MarkBlock::close(std::span<const std::string> links, std::span<const Site> sites) {
  for (MarkInfo& one : declared_) {
    if (const std::string problem = shown_name_problem(one.name); !problem.empty())
      return fail_at(one.name, "its name " + problem, "give the mark another name");
    if (std::ranges::count(declared_, one.name, &MarkInfo::name) > 1)
      return fail_at(one.name, "is declared twice", "give each mark its own name");
    if (!shown_name_problem(one.frame).empty())
      return fail_at(one.name, "has no frame", "name a link, a site, or \"odom\"");
    if (Status placed = place_frame(one, links, sites); !placed) return placed;
    if (one.points == 0) return fail_at(one.name, "has no point", "declare at least one");
    const auto share = [](float value) { return value >= 0.0F && value <= 1.0F; };
    if (!(one.size_m > 0.0 && one.size_m <= 1000.0) || !std::ranges::all_of(one.rgba, share)) {
      return fail_at(one.name, "has a size or a colour that is out of range",
                     "a size is above 0 and at most 1000 m, each part of a colour from 0 to 1");
    }
  }
  if (refused_.empty()) {
    if (!declared_.empty()) {
      shown_ = std::make_unique<Seqlock<State>>(1);
      shown_->write(std::span(&state_, 1));
    }
    return {};
  }
  return fail_at(refused_, "is more than there is room for",
                 "a controller has at most " + std::to_string(kMostMarks) + " marks with " +
                     std::to_string(kMostPoints) + " points together");
}

MarkBlock::State MarkBlock::look() const {
  State state;
  if (shown_ == nullptr || !shown_->read(std::span(&state, 1))) return {};
  return state;
}

}  // namespace tandem::hal
