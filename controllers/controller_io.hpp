// What a controller shares with the outside beside the images, as it declares it in configure():
// its own signals, parameters, inputs, marks and text events.
// Layer: controllers.  Thread: declared non-RT; its values the loop's, between and in its calls.
#pragma once

#include "base/archive.hpp"
#include "controllers/live_parameter.hpp"

namespace tandem {

/// One controller's. It outlives the controller, so that a handle into it never dangles.
struct ControllerIo {
  Parameters parameters;

  /// What the next cycles depend on.
  void archive(Archive& ar) { ar(parameters); }
};

}  // namespace tandem
