#include "dds/types.hpp"

#include <algorithm>
#include <cassert>
#include <vector>

namespace tandem::dds {

std::span<const Type> types() {
  static const std::vector<Type> table{
#define TANDEM_DDS_TYPE(package, kind, Name) \
  {&package##_##kind##_dds__##Name##__desc, #package "/" #kind "/" #Name},
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
