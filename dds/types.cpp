// The table of type_list.inc; a type is found by its ROS 2 name, its DDS name or its descriptor.
#include "dds/types.hpp"

#include <algorithm>
#include <cassert>
#include <vector>

namespace tandem::dds {
namespace {

Type row(const dds_topic_descriptor_t& descriptor, const char* ros_name) {
  const MessageDefinition* tree = find_definition(ros_name);
  assert(tree != nullptr);  // a test looks up every one
  return {.descriptor = &descriptor,
          .ros_name = ros_name,
          .tree = tree,
          .definition = full_text(*tree),
          .hash = type_hash(*tree)};
}

}  // namespace

std::span<const Type> types() {
  static const std::vector<Type> table{
#define TANDEM_DDS_TYPE(package, kind, Name) \
  row(package##_##kind##_dds__##Name##__desc, #package "/" #kind "/" #Name),
#include "dds/type_list.inc"
#undef TANDEM_DDS_TYPE
  };
  return table;
}

const Type* find_type(std::string_view name) {
  const auto found = std::ranges::find_if(
      types(), [&](const Type& type) { return type.ros_name == name || type.dds_name() == name; });
  return found == types().end() ? nullptr : &*found;
}

const Type& type_of(const dds_topic_descriptor_t& descriptor) {
  const auto found = std::ranges::find(types(), &descriptor, &Type::descriptor);
  assert(found != types().end());
  return *found;
}

}  // namespace tandem::dds
