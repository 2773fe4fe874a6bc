#include "apps/control/lenient_switch.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "base/nearest.hpp"
#include "base/utf8.hpp"

namespace tandem::apps {
namespace {

using runtime::ControllerStatus;
using Statuses = std::vector<ControllerStatus>;
using Names = std::vector<std::string>;

constexpr std::size_t kMostLeftOut = 8;  // that a text names

const ControllerStatus* status_of(const Statuses& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &ControllerStatus::name);
  return found == all.end() ? nullptr : &*found;
}

bool has(const Names& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

bool share_joint(const ControllerStatus& a, const ControllerStatus& b) {
  return std::ranges::any_of(a.claims, [&](const auto& claim) {
    return std::ranges::find(b.claims, claim.joint, &ControllerSetup::Claim::joint) !=
           b.claims.end();
  });
}

/// Why `one` cannot be started beside who is active after `is`; empty: it can.
std::string in_the_way(const Statuses& all, const LenientSwitch& is, const ControllerStatus& one) {
  for (const ControllerStatus& other : all) {
    const bool stays = other.active && !has(is.stop, other.name);
    if ((stays || has(is.start, other.name)) && share_joint(one, other))
      return " has a joint of " + other.name;
  }
  return {};
}

}  // namespace

LenientSwitch best_effort(const Statuses& all, const Names& stop, const Names& start) {
  LenientSwitch is;
  std::set<std::string> seen;
  const auto take = [&](const std::string& name, bool stops, Names& into) {
    const ControllerStatus* one = status_of(all, name);
    is.some |= one != nullptr;
    if (!seen.insert(name).second) return;
    const std::string why = one == nullptr         ? " is not loaded"
                            : one->active != stops ? (stops ? " is not active" : " is active")
                            : stops                ? ""
                                                   : in_the_way(all, is, *one);
    if (why.empty()) {
      into.push_back(name);
    } else {
      is.left_out.push_back(std::string(whole_characters(name, kMostNamed)) + why);
    }
  };
  for (const std::string& name : stop) take(name, true, is.stop);
  for (const std::string& name : start) take(name, false, is.start);
  return is;
}

std::string left_out_text(const LenientSwitch& is) {
  std::string text = "left out: ";
  for (std::size_t i = 0; i < std::min(is.left_out.size(), kMostLeftOut); ++i)
    text += (i == 0 ? "" : ", ") + is.left_out[i];
  if (is.left_out.size() > kMostLeftOut)
    text += fmt::format(" and {} others", is.left_out.size() - kMostLeftOut);
  return text;
}

Names with_who_is_in_the_way(const Statuses& all, Names stop, const Names& start) {
  for (const std::string& name : start) {
    const ControllerStatus* one = status_of(all, name);
    if (one == nullptr) continue;
    for (const ControllerStatus& other : all) {
      if (other.active && other.name != name && share_joint(*one, other) && !has(stop, other.name))
        stop.push_back(other.name);
    }
  }
  return stop;
}

}  // namespace tandem::apps
