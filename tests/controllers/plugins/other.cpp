// A controller that says it was built for another ABI or by another compiler.
#include "controllers/controller.hpp"

extern "C" __attribute__((visibility("default"))) const tandem::ControllerPlugin*
tandem_controller_plugin() {
  static const tandem::ControllerPlugin plugin{OTHER_ABI, OTHER_COMPILER, "other", "",
                                               []() -> tandem::Controller* { return nullptr; }};
  return &plugin;
}
