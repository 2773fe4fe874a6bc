// One topic of one process as bytes: a writer and a reader of any type.
// Layer: tests.  Thread: main.
#pragma once

#include <dds/ddsi/ddsi_serdata.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "dds/raw_endpoint.hpp"
#include "tests/dds/cdr_sample.hpp"

namespace tandem::dds::test {

inline Bytes bytes_of(const ddsi_serdata* data) {
  Bytes bytes(ddsi_serdata_size(data));
  ddsi_serdata_to_ser(data, 0, bytes.size(), bytes.data());
  return bytes;
}

/// What waits at a reader, as it came over the wire.
inline std::vector<Bytes> take_bytes(dds_entity_t reader) {
  std::vector<Bytes> out;
  ddsi_serdata* data = nullptr;
  dds_sample_info_t info;
  while (dds_takecdr(reader, &data, 1, &info, DDS_ANY_STATE) == 1) {
    if (info.valid_data) out.push_back(bytes_of(data));
    ddsi_serdata_unref(data);
  }
  return out;
}

/// A sample that Cyclone DDS itself decoded, as idlc's C type; freed with its owner.
class TypedSample {
 public:
  explicit TypedSample(const Type& type)
      : type_(&type), memory_(dds_alloc(type.descriptor->m_size)) {}
  ~TypedSample() {
    if (memory_ != nullptr) dds_sample_free(memory_, type_->descriptor, DDS_FREE_ALL);
  }
  TypedSample(TypedSample&& other) noexcept
      : type_(other.type_), memory_(std::exchange(other.memory_, nullptr)) {}
  TypedSample& operator=(TypedSample&&) = delete;

  [[nodiscard]] void* get() const { return memory_; }

 private:
  const Type* type_;
  void* memory_;
};

/// Turns bytes into a type's samples and samples into bytes, by Cyclone DDS.
class Codec {
 public:
  Codec(Participant& participant, const Type& type)
      : type_(&type),
        writer_(*RawEndpoint::create(EndpointKind::kWriter, participant.get(), type, topic(), {})),
        reader_(*RawEndpoint::create(EndpointKind::kReader, participant.get(), type, topic(), {})) {
    const TypedSample nothing(type);  // the serialised type is to be had of a sample only
    dds_write(writer_.entity.get(), nothing.get());
    dds_sample_info_t info;
    dds_takecdr(reader_.entity.get(), &first_, 1, &info, DDS_ANY_STATE);
  }
  ~Codec() {
    if (first_ != nullptr) ddsi_serdata_unref(first_);
  }
  Codec(const Codec&) = delete;
  Codec& operator=(const Codec&) = delete;

  /// Null when Cyclone DDS takes them for malformed. The caller unrefs it.
  [[nodiscard]] ddsi_serdata* accept(std::span<const std::byte> bytes) const {
    ddsrt_iovec_t one{.iov_base = const_cast<std::byte*>(bytes.data()), .iov_len = bytes.size()};
    return ddsi_serdata_from_ser_iov(first_->type, SDK_DATA, 1, &one, bytes.size());
  }

  [[nodiscard]] std::optional<TypedSample> sample(std::span<const std::byte> bytes) const {
    ddsi_serdata* data = accept(bytes);
    if (data == nullptr) return std::nullopt;
    std::optional<TypedSample> out(std::in_place, *type_);
    const bool well = ddsi_serdata_to_sample(data, out->get(), nullptr, nullptr);
    ddsi_serdata_unref(data);
    if (!well) out.reset();
    return out;
  }

  /// The bytes of a sample as they go over the wire.
  [[nodiscard]] Bytes bytes(const TypedSample& sample) const {
    dds_write(writer_.entity.get(), sample.get());
    const std::vector<Bytes> all = take_bytes(reader_.entity.get());
    return all.empty() ? Bytes{} : all.back();
  }

 private:
  [[nodiscard]] std::string topic() const { return "codec/" + type_->ros_name; }

  const Type* type_;
  RawEndpoint writer_;
  RawEndpoint reader_;
  ddsi_serdata* first_ = nullptr;
};

}  // namespace tandem::dds::test
