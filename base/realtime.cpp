// The names of the one-byte codes that real-time functions return.
#include "base/realtime.hpp"

namespace tandem {

const char* to_string(Code code) noexcept {
  switch (code) {
    case Code::kOk: return "Ok";
    case Code::kTimeout: return "Timeout";
    case Code::kBusOff: return "BusOff";
    case Code::kQueueFull: return "QueueFull";
    case Code::kNotFinite: return "NotFinite";
    case Code::kOutOfRange: return "OutOfRange";
    case Code::kFault: return "Fault";
    case Code::kDiverged: return "Diverged";
    case Code::kStopped: return "Stopped";
  }
  return "?";
}

}  // namespace tandem
