// Whatever bytes a peer sends as a sample, and whatever text stands for a definition. The first
// byte chooses: the definition that the rest is a sample of, or that the rest is a definition.
#include <cstdint>
#include <span>
#include <string_view>

#include "dds/cdr.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem::dds;

using tandem::fuzz::require;

/// Numbers, texts and bools in it.
std::size_t leaves(const Value& value) {
  std::size_t count = 0;
  if (const auto* list = std::get_if<Value::List>(&value.of)) {
    for (const Value& one : *list) count += leaves(one);
    return count;
  }
  if (const auto* message = std::get_if<Value::Message>(&value.of)) {
    for (const Member& one : *message) count += leaves(one.value);
    return count;
  }
  return 1;
}

void check_sample(const MessageDefinition& definition, std::span<const std::byte> bytes) {
  const auto value = decode(definition, bytes);
  if (value) {
    require(leaves(*value) <= bytes.size());  // each takes a byte at least
  } else {
    require(!value.error().message.empty());
  }
}

void check_definition(std::string_view text) {
  for (const char* name : {"a_msgs/msg/B", "a_msgs/srv/B"}) {
    auto read = parse_definition(name, text);
    if (!read) {
      require(!read.error().message.empty());
      continue;
    }
    for (const MessageDefinition& one : *read) require(!one.fields.empty());
    if (!resolve(*read)) continue;
    for (const MessageDefinition& one : *read) {
      require(type_hash(one).size() == std::string_view("RIHS01_").size() + 64);
      require(full_text(one).size() >= one.text.size());
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto rest = std::span(data, size).subspan(1);
  const auto all = definitions();
  if (data[0] < all.size()) {
    check_sample(all[data[0]], std::as_bytes(rest));
  } else {
    check_definition({reinterpret_cast<const char*>(rest.data()), rest.size()});
  }
  return 0;
}
