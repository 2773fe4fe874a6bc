// A controller whose entry point leaves null what its macro NULL_… says.
#include "controllers/controller.hpp"

extern "C" __attribute__((visibility("default"))) const tandem::ControllerPlugin*
tandem_controller_plugin() {
  static tandem::ControllerPlugin plugin{tandem::kControllerAbi, __VERSION__, "null", "Is null.",
                                         []() -> tandem::Controller* { return nullptr; }};
#if defined(NULL_PLUGIN)
  return nullptr;
#elif defined(NULL_NAME)
  plugin.name = nullptr;
#elif defined(NULL_DOC)
  plugin.doc = nullptr;
#elif defined(NULL_CREATE)
  plugin.create = nullptr;
#endif
  return &plugin;
}
