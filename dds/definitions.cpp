// The definitions of dds/ros2 and dds/tandem_msgs, as the build put them into definitions.inc.
#include <algorithm>
#include <cassert>
#include <iterator>

#include "dds/message_definition.hpp"

namespace tandem::dds {
namespace {

struct Source {
  std::string_view name;
  std::string_view text;
};

constexpr Source kSources[] = {
#include <definitions.inc>
};

std::vector<MessageDefinition> parsed() {
  std::vector<MessageDefinition> all;
  for (const Source& source : kSources) {
    auto some = parse_definition(source.name, source.text);
    if (some) std::ranges::move(*some, std::back_inserter(all));
    assert(some);  // a test looks for every name
  }
  [[maybe_unused]] const Status resolved = resolve(all);
  assert(resolved);
  return all;
}

}  // namespace

std::span<const MessageDefinition> definitions() {
  static const std::vector<MessageDefinition> all = parsed();
  return all;
}

const MessageDefinition* find_definition(std::string_view ros_name) {
  const auto all = definitions();
  const auto found = std::ranges::lower_bound(all, ros_name, {}, &MessageDefinition::name);
  return found != all.end() && found->name == ros_name ? &*found : nullptr;
}

}  // namespace tandem::dds
