// What a controller shares with the outside beside the images, as it declares it in configure():
// its own signals, parameters, inputs, marks and text events.
// Layer: controllers.  Thread: declared non-RT; its values the loop's, between and in its calls.
#pragma once

#include "base/archive.hpp"
#include "controllers/inputs.hpp"
#include "controllers/live_parameter.hpp"
#include "controllers/marks.hpp"
#include "controllers/signals.hpp"
#include "controllers/text_events.hpp"
#include "hal/signal_block.hpp"

namespace tandem {

/// One controller's. It outlives the controller, so that a handle into it never dangles.
struct ControllerIo {
  hal::SignalBlock signals;
  hal::MarkBlock marks;
  TextEventSlots texts;
  Parameters parameters;
  ControllerInputs inputs;

  /// What the next cycles depend on.
  void archive(Archive& ar) {
    archive_shown(ar);
    ar(parameters);
  }
  /// All but the parameters.
  void archive_shown(Archive& ar) { ar(signals, marks, texts, inputs); }
};

}  // namespace tandem
