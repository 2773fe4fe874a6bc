// Frames as literal bytes, for tests against the standard's layouts.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <initializer_list>
#include <string>
#include <vector>

#include "canopen/frame.hpp"

namespace tandem::canopen {

inline Frame wire(std::uint32_t id, std::initializer_list<int> bytes) {
  Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::size_t i = 0;
  for (const int byte : bytes) frame.data[i++] = static_cast<std::uint8_t>(byte);
  return frame;
}

inline void PrintTo(const Frame& frame, std::ostream* out) {
  char text[8];
  std::snprintf(text, sizeof text, "%03X:", static_cast<unsigned>(frame.id));
  *out << text;
  for (const std::uint8_t byte : frame.payload()) {
    std::snprintf(text, sizeof text, " %02X", byte);
    *out << text;
  }
}

/// A sink with its storage, emptied by take().
class Outbox {
 public:
  FrameSink& sink() { return sink_; }
  std::vector<Frame> take() {
    std::vector<Frame> frames(sink_.frames().begin(), sink_.frames().end());
    sink_.clear();
    return frames;
  }

 private:
  std::array<Frame, 32> storage_{};
  FrameSink sink_{storage_};
};

using Frames = std::vector<Frame>;

}  // namespace tandem::canopen
