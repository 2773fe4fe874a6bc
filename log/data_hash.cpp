#include "log/data_hash.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "log/bytes.hpp"
#include "log/mcap_format.hpp"
#include "log/schema.hpp"

namespace tandem::log {

void DataHash::add(std::uint16_t channel, std::int64_t time_ns,
                   std::span<const std::byte> data) noexcept {
  const std::size_t head = std::min(data.size(), kCdrHeader.size());
  add(channel, time_ns, data.first(head), data.subspan(head));
}

void DataHash::add(std::uint16_t channel, std::int64_t time_ns,
                   std::span<const std::byte> cdr_header,
                   std::span<const std::byte> body) noexcept {
  XXH128_canonical_t digest;
  XXH128_canonicalFromHash(&digest, XXH3_128bits(body.data(), body.size()));
  std::array<std::byte, 10 + kCdrHeader.size() + sizeof digest> hashed;
  std::byte* out = hashed.data();
  store(out, channel);
  store(out + 2, static_cast<std::uint64_t>(time_ns));
  out = std::ranges::copy(cdr_header, out + 10).out;
  std::memcpy(out, &digest, sizeof digest);
  hash_.update(std::span(hashed.data(), out + sizeof digest));
}

}  // namespace tandem::log
