// Writers and readers of typed topics.
// Layer: dds.  Thread: any, non-RT: no DDS call is fit for the real-time thread.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/result.hpp"
#include "dds/participant.hpp"
#include "dds/raw_endpoint.hpp"
#include "dds/types.hpp"

namespace tandem::dds {

/// A topic with its writer or reader, one of the participant's node. The participant outlives it.
class Endpoint {
 public:
  using Kind = EndpointKind;

  /// @param topic  the DDS name: Participant::topic_name()
  /// Errors: RawEndpoint::create()'s.
  [[nodiscard]] static Result<Endpoint> create(Kind kind, Participant& participant,
                                               const Type& type, const std::string& topic,
                                               const Qos& qos, const MakeTopic& make = &make_topic);

  [[nodiscard]] dds_entity_t get() const noexcept { return raw_.entity.get(); }
  [[nodiscard]] const std::string& topic() const noexcept { return topic_; }
  /// How many of the other kind are connected.
  [[nodiscard]] std::uint32_t matched() const;

 private:
  Endpoint(Kind kind, std::string topic, RawEndpoint raw, RosGraph& graph);

  Kind kind_;
  std::string topic_;
  RawEndpoint raw_;
  GraphEntry entry_;  // after the entity, so that it leaves the graph first
};

template <class T>
class Writer {
 public:
  [[nodiscard]] static Result<Writer> create(Participant& participant, const std::string& topic,
                                             const Qos& qos) {
    auto made = Endpoint::create(Endpoint::Kind::kWriter, participant, type<T>(), topic, qos);
    if (!made) return std::unexpected(made.error());
    return Writer(std::move(*made));
  }

  /// Hands a sample to the readers; never waits for one of them.
  /// @return false: it was not sent, because a reader is too far behind or memory is short.
  bool write(const T& sample) { return dds_write(endpoint_.get(), &sample) == DDS_RETCODE_OK; }

  [[nodiscard]] const Endpoint& endpoint() const noexcept { return endpoint_; }

 private:
  explicit Writer(Endpoint endpoint) : endpoint_(std::move(endpoint)) {}
  Endpoint endpoint_;
};

template <class T>
class Reader {
 public:
  [[nodiscard]] static Result<Reader> create(Participant& participant, const std::string& topic,
                                             const Qos& qos) {
    auto made = Endpoint::create(Endpoint::Kind::kReader, participant, type<T>(), topic, qos);
    if (!made) return std::unexpected(made.error());
    return Reader(std::move(*made));
  }

  /// Calls `use(sample, info)` for every sample that waits, the oldest first. Nothing in it has
  /// been checked but that it is of the type. Samples that only announce a writer's end are left
  /// out. @return how many there were.
  template <class Use>
  std::size_t take(Use use) {
    std::size_t count = 0;
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    for (;;) {
      samples.fill(nullptr);  // so that the samples are lent
      const dds_return_t taken =
          dds_take(endpoint_.get(), samples.data(), infos.data(), kBatch, kBatch);
      if (taken <= 0) return count;
      for (std::size_t i = 0; i < static_cast<std::size_t>(taken); ++i) {
        if (!infos[i].valid_data) continue;
        use(*static_cast<const T*>(samples[i]), infos[i]);
        ++count;
      }
      dds_return_loan(endpoint_.get(), samples.data(), taken);
    }
  }

  [[nodiscard]] const Endpoint& endpoint() const noexcept { return endpoint_; }

 private:
  static constexpr std::size_t kBatch = 16;
  explicit Reader(Endpoint endpoint) : endpoint_(std::move(endpoint)) {}
  Endpoint endpoint_;
};

}  // namespace tandem::dds
