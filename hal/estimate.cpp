// The layout of the estimate image, from estimate_fields.inc.
#include "hal/estimate.hpp"

#include <memory>

#include "hal/wire_name.hpp"

namespace tandem::hal {
namespace {

// `count` of a row says these names.
std::shared_ptr<const Layout> estimate_layout(const EstimateShape& shape) {
  const auto [base, feet, joints, wrenches] = shape;
  auto layout = std::make_shared<Layout>();
#define TANDEM_FIELD(type, name, count, doc) \
  layout->add(wire_name(#name), field_type<type>(), count, doc);
#include "hal/estimate_fields.inc"
#undef TANDEM_FIELD
  return layout;
}

}  // namespace

EstimateImage::EstimateImage(const EstimateShape& shape) : Image(estimate_layout(shape)) {
#define TANDEM_FIELD(type, name, count, doc) name##_ = slot(#name);
#include "hal/estimate_fields.inc"
#undef TANDEM_FIELD
}

}  // namespace tandem::hal
