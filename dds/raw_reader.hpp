// A reader of a topic whose type is only known by name: samples come as bytes.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "base/result.hpp"
#include "dds/endpoint.hpp"

namespace tandem::dds {

class RawReader {
 public:
  using Use = std::function<void(std::span<const std::byte> cdr, const dds_sample_info_t& info)>;

  /// Errors: Endpoint::create()'s.
  [[nodiscard]] static Result<RawReader> create(Participant& participant, const Type& type,
                                                const std::string& topic, const Qos& qos);

  /// Blocks until samples wait to be taken, `most` at most. @return whether there are some.
  bool wait(std::chrono::milliseconds most);

  /// Calls `use` for every sample that waits, the oldest first: for decode(), the four bytes of
  /// the encoding in front. @return how many there were.
  std::size_t take(const Use& use);

  [[nodiscard]] const Endpoint& endpoint() const noexcept { return endpoint_; }

 private:
  RawReader(Endpoint endpoint, Entity waitset)
      : endpoint_(std::move(endpoint)), waitset_(std::move(waitset)) {}
  Endpoint endpoint_;
  Entity waitset_;  // after the endpoint that it watches, so that it goes first
};

}  // namespace tandem::dds
