// The layout of the truth image, from truth_fields.inc.
#include "hal/truth.hpp"

#include <memory>

#include "hal/wire_name.hpp"

namespace tandem::hal {
namespace {

// `count` of a row says these names.
std::shared_ptr<const Layout> truth_layout(std::size_t joints, std::size_t feet, std::size_t loops,
                                           std::size_t passive, std::size_t ground) {
  auto layout = std::make_shared<Layout>();
#define TANDEM_FIELD(type, name, count, doc) \
  layout->add(wire_name(#name), field_type<type>(), count, doc);
#include "hal/truth_fields.inc"
#undef TANDEM_FIELD
  return layout;
}

}  // namespace

TruthImage::TruthImage(std::size_t joints, std::size_t feet, std::size_t loops, std::size_t passive,
                       std::size_t ground)
    : Image(truth_layout(joints, feet, loops, passive, ground)) {
#define TANDEM_FIELD(type, name, count, doc) name##_ = slot(#name);
#include "hal/truth_fields.inc"
#undef TANDEM_FIELD
}

}  // namespace tandem::hal
