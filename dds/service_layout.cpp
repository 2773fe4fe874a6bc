// A serialised type of our own for Cyclone DDS 0.10, which takes the 16 bytes out and in. Cyclone
// DDS hands out neither a request's number nor its inline QoS, and writes none: the first two are
// read from the packet that it received. The last takes the place of the key's hash and the status
// in the packet that it is about to send. So its own writer sends the reply, repeats and encrypts
// it.
#include "dds/service_layout.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/q_protocol.h>
#include <dds/ddsi/q_radmin.h>

#include <bit>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "dds/cyclone_inside.hpp"

namespace tandem::dds {
namespace {

constexpr std::size_t kEncoding = 4;   // in front of a sample: names its encoding
constexpr std::size_t kIdentity = 16;  // after it: ServiceHeader
constexpr std::size_t kMostPadding = 3;

// Parameters of inline QoS (RTPS 2.5, table 9.13; the second is Fast DDS's own, older number).
constexpr std::uint16_t kRelatedSample = 0x0083, kRelatedSampleOfFast = 0x800f;
constexpr std::uint16_t kRelatedSampleBytes = 24;
/// Nobody knows this parameter. Its bit 0x4000 tells readers to ignore such a sample, which Cyclone
/// DDS obeys, and Fast DDS does not look at.
constexpr std::uint16_t kNotForOthers = 0x7fff;
constexpr std::uint16_t kPadding = 0x0000;

struct Parameter {
  std::uint16_t id, bytes;
};

/// The type as Cyclone DDS sees it.
struct Layout : ddsi_sertype {
  const dds_topic_descriptor_t* descriptor;
};

const std::uint32_t* operations(const ddsi_sertype* type) {
  return static_cast<const Layout*>(type)->descriptor->m_ops;
}

/// A sample as bytes.
struct Packed : ddsi_serdata {
  Packed(const ddsi_sertype* of_type, ddsi_serdata_kind of_kind) : ddsi_serdata{} {
    ddsi_serdata_init(this, of_type, of_kind);
    if (of_type != nullptr) hash = of_type->serdata_basehash;
  }
  void resize(std::size_t encoded) {
    size = encoded;
    words.assign((kEncoding + encoded + 7) / 8 + 1, 0);
  }
  /// With the encoding in front; what follows it is aligned to 8 bytes.
  [[nodiscard]] std::byte* bytes() {
    return std::as_writable_bytes(std::span(words)).data() + kEncoding;
  }
  [[nodiscard]] char* body() { return reinterpret_cast<char*>(bytes() + kEncoding); }

  std::vector<std::uint64_t> words;
  std::size_t size = 0;
  bool malformed = false;
  std::optional<FastCall> call;
};

Packed* packed(const ddsi_serdata* data) {
  return static_cast<Packed*>(const_cast<ddsi_serdata*>(data));
}

/// What came, as Cyclone DDS's own structures want it. What is malformed stays, to be counted.
ddsi_serdata* receive(const ddsi_sertype* type, ddsi_serdata_kind kind,
                      std::span<const std::byte> from, const std::optional<FastCall>& call) {
  auto out = std::make_unique<Packed>(type, kind);
  out->call = call;
  out->malformed = true;
  // Plain CDR: {0, 1} little-endian, {0, 0} big-endian, then two bytes of options.
  if (from.size() < kEncoding || from[0] != std::byte{0} || from[1] > std::byte{1}) {
    return out.release();
  }
  const std::size_t identity = call ? kIdentity : 0;
  out->resize(from.size() + identity);
  std::memcpy(out->bytes(), from.data(), kEncoding);
  std::memcpy(out->body() + identity, from.data() + kEncoding, from.size() - kEncoding);
  const auto body = static_cast<std::uint32_t>(out->size - kEncoding);
  const bool little = from[1] == std::byte{1};
  std::uint32_t end = 0;
  out->malformed = dds_stream_normalize_data(out->body(), &end, body,
                                             little != (std::endian::native == std::endian::little),
                                             CDR_ENC_VERSION_1, operations(type)) == nullptr ||
                   body - end > kMostPadding;
  return out.release();
}

std::optional<FastCall> find_call(const nn_rdata* data) {
  const unsigned char* packet = NN_RMSG_PAYLOAD(data->rmsg);
  const auto start = static_cast<std::size_t>(NN_RDATA_SUBMSG_OFF(data));
  const auto end = static_cast<std::size_t>(NN_RDATA_PAYLOAD_OFF(data));
  Data_DataFrag_common_t header;
  std::memcpy(&header, packet + start, sizeof header);
  if ((header.smhdr.flags & DATA_FLAG_INLINE_QOS) == 0) return std::nullopt;
  const bool little = (header.smhdr.flags & SMFLAG_ENDIANNESS) != 0;
  const bool swap = little != (std::endian::native == std::endian::little);
  const auto right = [swap](std::uint16_t value) {
    return swap ? static_cast<std::uint16_t>(value << 8 | value >> 8) : value;
  };
  std::size_t at = start + offsetof(Data_DataFrag_common_t, octetsToInlineQos) +
                   sizeof header.octetsToInlineQos + header.octetsToInlineQos;
  std::optional<FastCall> call;
  while (at + sizeof(Parameter) <= end) {
    Parameter one{};
    std::memcpy(&one, packet + at, sizeof one);
    one = {.id = right(one.id), .bytes = right(one.bytes)};
    at += sizeof one;
    if (one.id == PID_SENTINEL || one.bytes > end - at) break;
    const bool standard = one.id == kRelatedSample;
    if ((standard || one.id == kRelatedSampleOfFast) && one.bytes >= kRelatedSampleBytes &&
        (standard || !call)) {
      call.emplace();
      std::memcpy(call->client.data(), packet + at, call->client.size());
      call->parameter = one.id;
      call->sequence = static_cast<std::uint64_t>(header.writerSN.high) << 32 | header.writerSN.low;
    }
    at += one.bytes;
  }
  return call;
}

ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragment, std::size_t size) {
  const std::optional<FastCall> call = find_call(fragment);
  std::vector<std::byte> bytes(size);
  std::size_t filled = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= filled) continue;  // fragments may overlap
    const unsigned char* from = NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(&bytes[filled], from + filled - fragment->min, fragment->maxp1 - filled);
    filled = fragment->maxp1;
  }
  return receive(type, kind, bytes, call);
}

ddsi_serdata* from_parts(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                         const ddsrt_iovec_t* parts, std::size_t size) {
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  for (const ddsrt_iovec_t& one : std::span(parts, count)) {
    const auto* from = static_cast<const std::byte*>(one.iov_base);
    bytes.insert(bytes.end(), from, from + one.iov_len);
  }
  return receive(type, kind, bytes, std::nullopt);
}

Packed* pack(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample,
             const std::optional<FastCall>& call) {
  auto out = std::make_unique<Packed>(type, kind);
  dds_ostream_t stream;
  dds_ostream_init(&stream, 0, CDR_ENC_VERSION_1);
  const bool well =
      dds_stream_write(&stream, static_cast<const char*>(sample), operations(type)) != nullptr;
  if (well) {
    const std::size_t identity = call ? kIdentity : 0;
    const std::size_t body = stream.m_index - identity;
    const std::size_t padding = (4 - body % 4) % 4;
    out->resize(kEncoding + body + padding);
    out->bytes()[1] = std::byte{std::endian::native == std::endian::little};
    out->bytes()[3] = static_cast<std::byte>(padding);
    std::memcpy(out->body(), stream.m_buffer + identity, body);
    out->call = call;
  }
  dds_ostream_fini(&stream);
  return well ? out.release() : nullptr;
}

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) {
  return pack(type, kind, sample, std::nullopt);
}

bool to_sample(const ddsi_serdata* data, void* sample, void** /*from*/, void* /*to*/) {
  Packed& in = *packed(data);
  if (in.malformed) return false;
  if (in.kind != SDK_DATA) return true;
  dds_istream_t stream;
  dds_istream_init(&stream, static_cast<std::uint32_t>(in.size - kEncoding), in.body(),
                   CDR_ENC_VERSION_1);
  dds_stream_read(&stream, static_cast<char*>(sample), operations(in.type));
  return true;
}

/// Where in the packet that this thread makes the two parameters are that give way.
struct Place {
  const ddsi_serdata* of = nullptr;
  unsigned char* hash = nullptr;
};
thread_local Place t_place;

void write(unsigned char*& to, const void* from, std::size_t bytes) {
  std::memcpy(to, from, bytes);
  to += bytes;
}

/// Cyclone DDS calls this while it makes a packet: `hash` is in it, after the parameter's header.
void take_place_of_hash(const ddsi_serdata* data, ddsi_keyhash* hash, bool /*md5*/) {
  unsigned char* header = hash->value - sizeof(Parameter);
  const Parameter expected{.id = PID_KEYHASH, .bytes = sizeof hash->value};
  std::memset(hash->value, 0, sizeof hash->value);
  if (std::memcmp(header, &expected, sizeof expected) != 0) return;
  if (packed(data)->call) {
    t_place = {.of = data, .hash = hash->value};
  } else {
    std::memcpy(header, &kPadding, sizeof kPadding);  // there is no key
  }
}

/// And then to_part(), with the status after the hash.
void write_call(const FastCall& call, unsigned char* hash) {
  const Parameter status{.id = PID_STATUSINFO, .bytes = 8};
  if (std::memcmp(hash + sizeof(ddsi_keyhash), &status, sizeof status) != 0) return;
  const Parameter others{.id = kNotForOthers, .bytes = 0};
  const Parameter related{.id = call.parameter, .bytes = kRelatedSampleBytes};
  const auto high = static_cast<std::int32_t>(call.sequence >> 32);
  const auto low = static_cast<std::uint32_t>(call.sequence);
  static_assert(2 * sizeof(Parameter) + kRelatedSampleBytes ==
                sizeof(Parameter) + sizeof(ddsi_keyhash) + sizeof(Parameter) + 8);
  unsigned char* to = hash - sizeof(Parameter);
  write(to, &others, sizeof others);
  write(to, &related, sizeof related);
  write(to, call.client.data(), call.client.size());
  write(to, &high, sizeof high);
  write(to, &low, sizeof low);
}

ddsi_serdata* to_part(const ddsi_serdata* data, std::size_t offset, std::size_t size,
                      ddsrt_iovec_t* part) {
  Packed& in = *packed(data);
  if (const Place place = std::exchange(t_place, {}); place.of == data && offset == 0) {
    write_call(*in.call, place.hash);
  }
  *part = {.iov_base = in.bytes() + offset, .iov_len = size};
  return ddsi_serdata_ref(data);
}

constexpr ddsi_serdata_ops kSampleOperations{
    .eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; },  // there is no key
    .get_size =
        [](const ddsi_serdata* data) { return static_cast<std::uint32_t>(packed(data)->size); },
    .from_ser = &from_fragments,
    .from_ser_iov = &from_parts,
    .from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
      return new Packed(type, SDK_KEY);
    },
    .from_sample = &from_sample,
    .to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size,
                 void* to) { std::memcpy(to, packed(data)->bytes() + offset, size); },
    .to_ser_ref = &to_part,
    .to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); },
    .to_sample = &to_sample,
    .to_untyped = [](const ddsi_serdata* data) -> ddsi_serdata* {
      auto* out = new Packed(data->type, SDK_KEY);
      out->type = nullptr;
      return out;
    },
    .untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**,
                            void*) { return true; },
    .free = [](ddsi_serdata* data) { delete packed(data); },
    .print = [](const ddsi_sertype*, const ddsi_serdata*, char* text,
                std::size_t size) -> std::size_t {
      if (size > 0) text[0] = '\0';
      return 0;
    },
    .get_keyhash = &take_place_of_hash,
#ifdef DDS_HAS_SHM
    .get_sample_size = nullptr,
    .from_iox_buffer = nullptr,
#endif
};

const ddsi_sertype_ops kTypeOperations{
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free =
        [](ddsi_sertype* type) {
          ddsi_sertype_fini(type);
          delete static_cast<Layout*>(type);
        },
    .zero_samples =
        [](const ddsi_sertype* type, void* samples, std::size_t count) {
          std::memset(samples, 0, count * static_cast<const Layout*>(type)->descriptor->m_size);
        },
    .realloc_samples =
        [](void** each, const ddsi_sertype* type, void* old, std::size_t had, std::size_t count) {
          const std::size_t size = static_cast<const Layout*>(type)->descriptor->m_size;
          auto* all = static_cast<char*>(had == count ? old : dds_realloc(old, size * count));
          if (count > had) std::memset(all + had * size, 0, (count - had) * size);
          for (std::size_t i = 0; i < count; ++i) each[i] = all + i * size;
        },
    .free_samples =
        [](const ddsi_sertype* type, void** each, std::size_t count, dds_free_op_t what) {
          for (void* one : std::span(each, count)) dds_stream_free_sample(one, operations(type));
          if (count > 0 && (what & DDS_FREE_ALL_BIT) != 0) dds_free(each[0]);
        },
    .equal = [](const ddsi_sertype* one,
                const ddsi_sertype* other) { return operations(one) == operations(other); },
    .hash = [](const ddsi_sertype*) { return std::uint32_t{0}; },
    .type_id = nullptr,
    .type_map = nullptr,
    .type_info = nullptr,
    .derive_sertype = nullptr,
    .get_serialized_size = nullptr,
    .serialize_into = nullptr,
};

}  // namespace

bool answers_fast_dds() noexcept { return true; }

dds_entity_t create_service_topic(dds_entity_t participant, const Type& type, const char* name,
                                  const ddsi_sertype** layout) {
  auto* made = new Layout{};
  ddsi_sertype_init(made, type.dds_name(), &kTypeOperations, &kSampleOperations, true);
  made->descriptor = type.descriptor;
  ddsi_sertype* known = made;
  const dds_entity_t topic =
      dds_create_topic_sertype(participant, name, &known, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(made);
  *layout = known;
  return topic;
}

std::optional<FastCall> fast_call_of(const ddsi_serdata* request) { return packed(request)->call; }

bool write_reply(dds_entity_t writer, const ddsi_sertype* layout, const void* sample,
                 const std::optional<FastCall>& call) {
  if (!call) return dds_write(writer, sample) == DDS_RETCODE_OK;
  tandem_dds_send_hashes(writer);
  Packed* reply = pack(layout, SDK_DATA, sample, call);
  if (reply == nullptr) return false;
  reply->timestamp.v = dds_time();
  // For Cyclone DDS the bit means nothing. It makes room for eight bytes of status.
  reply->statusinfo = NN_STATUSINFO_OSPL_AUTO;
  return dds_forwardcdr(writer, reply) == DDS_RETCODE_OK;
}

}  // namespace tandem::dds
