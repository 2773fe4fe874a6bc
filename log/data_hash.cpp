#include "log/data_hash.hpp"

#ifdef TANDEM_XXHASH_DISPATCH
#include <xxh_x86dispatch.h>  // with the widest instructions that this CPU has
#else
#include <xxhash.h>
#endif

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
  static_assert(kMostOfMessage == 10 + kCdrHeader.size() + sizeof digest);
  if (waiting_.size() - waits_ < kMostOfMessage) take_waiting();
  std::byte* out = waiting_.data() + waits_;
  store(out, channel);
  store(out + 2, static_cast<std::uint64_t>(time_ns));
  out = std::ranges::copy(cdr_header, out + 10).out;
  std::memcpy(out, &digest, sizeof digest);
  waits_ = static_cast<std::size_t>(out + sizeof digest - waiting_.data());
}

void DataHash::take_waiting() noexcept {
  hash_.update(std::span(waiting_).first(waits_));
  waits_ = 0;
}

std::string DataHash::finish() {
  take_waiting();
  return hash_.finish();
}

}  // namespace tandem::log
