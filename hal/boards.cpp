// The layout of the boards' image, from boards_fields.inc.
#include "hal/boards.hpp"

#include <memory>

#include "hal/wire_name.hpp"

namespace tandem::hal {
namespace {

// `count` of a row says these names.
std::shared_ptr<const Layout> boards_layout(std::size_t joints, std::size_t buses) {
  auto layout = std::make_shared<Layout>();
#define TANDEM_FIELD(type, name, count, doc) \
  layout->add(wire_name(#name), field_type<type>(), count, doc);
#include "hal/boards_fields.inc"
#undef TANDEM_FIELD
  return layout;
}

}  // namespace

BoardsImage::BoardsImage(std::size_t joints, std::size_t buses)
    : Image(boards_layout(joints, buses)) {
#define TANDEM_FIELD(type, name, count, doc) name##_ = slot(#name);
#include "hal/boards_fields.inc"
#undef TANDEM_FIELD
}

}  // namespace tandem::hal
