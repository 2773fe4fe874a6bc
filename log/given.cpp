#include "log/given.hpp"

#include <cstring>

namespace tandem::log {

const hal::Layout& given_layout() {
  static const hal::Layout layout = [] {
    using enum hal::FieldType;
    hal::Layout made;
    made.add("cycle", kU64, 1, "that took it");
    made.add("time_ns", kI64, 1, "[ns] its nominal time");
    made.add("value", kF64, Given().values.size(), "as the kind says");
    made.add("start", kU32, 1, "controllers to start, a bit per slot");
    made.add("stop", kU32, 1, "controllers to stop, a bit per slot");
    made.add("index", kU32, 1, "joint or slot; 4294967295: none");
    made.add("kind", kU8, 1, "log::GivenKind");
    return made;
  }();
  return layout;
}

std::optional<Given> decode_given(std::span<const std::byte> body) {
  if (body.size() < kGivenBytes) return std::nullopt;
  Given given;
  std::memcpy(static_cast<void*>(&given), body.data(), kGivenBytes);
  return given;
}

}  // namespace tandem::log
