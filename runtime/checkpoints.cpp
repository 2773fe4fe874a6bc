#include "runtime/checkpoints.hpp"

#include <algorithm>
#include <utility>

namespace tandem::runtime {

void Checkpoints::add(Checkpoint one) {
  if (!all_.empty() && all_.back().cycle == one.cycle) erase(all_.size() - 1);
  bytes_ += one.size();
  all_.push_back(std::move(one));
  thin();
}

void Checkpoints::forget_after(std::uint64_t cycle) {
  while (!all_.empty() && all_.back().cycle > cycle) erase(all_.size() - 1);
}

void Checkpoints::erase(std::size_t index) {
  const Checkpoint& one = all_[index];
  bytes_ -= one.size();
  if (one.elsewhere.number != 0) gone_.push_back(one.elsewhere);
  all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(index));
}

const Checkpoint* Checkpoints::before(std::uint64_t cycle) const noexcept {
  const auto after = std::ranges::upper_bound(all_, cycle, {}, &Checkpoint::cycle);
  return after == all_.begin() ? nullptr : &*std::prev(after);
}

void Checkpoints::thin() {
  while (bytes_ > budget_bytes_ && all_.size() > 2) {
    const std::uint64_t now = all_.back().cycle;
    std::size_t worst = 1;
    double closest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i + 1 < all_.size(); ++i) {
      const auto gap = static_cast<double>(all_[i + 1].cycle - all_[i - 1].cycle);
      const double per_age = gap / static_cast<double>(now - all_[i].cycle);
      if (per_age >= closest) continue;
      closest = per_age;
      worst = i;
    }
    erase(worst);
  }
}

}  // namespace tandem::runtime
