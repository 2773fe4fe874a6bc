// How answers of a registry get into replies of idlc's C structs.
// Layer: apps/control.  Thread: any.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

#include "apps/text/console.hpp"
#include "dds/service_server.hpp"

namespace tandem::apps {

/// Why not, or a remark; empty when there is nothing to say.
[[nodiscard]] std::string message_of(const Json& answer);

/// A text of `object`; empty when it has none.
[[nodiscard]] char* text_of(const Json& object, const char* key, dds::ReplyMemory& memory);

/// A list of `answer`; an empty one when it has none.
[[nodiscard]] const Json& list_of(const Json& answer, const char* key);

/// The texts of a request's sequence.
[[nodiscard]] Json texts_of(const dds_sequence_string& sequence);

/// Room for `count` elements in `sequence`, of the sequence's own type.
template <class Sequence>
auto room(Sequence& sequence, std::size_t count, dds::ReplyMemory& memory) {
  using Element = std::remove_pointer_t<decltype(sequence._buffer)>;
  sequence._buffer = memory.array<Element>(count);
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(count);
  return std::span(sequence._buffer, count);
}

/// `sequence` gets copies of `texts`: strings, or texts of JSON.
template <class Texts>
void fill_texts(const Texts& texts, dds_sequence_string& sequence, dds::ReplyMemory& memory) {
  const auto places = room(sequence, texts.size(), memory);
  std::size_t i = 0;
  for (const auto& one : texts) places[i++] = memory.text(std::string(one));
}

}  // namespace tandem::apps
