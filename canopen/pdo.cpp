// Mapping may change only while the PDO is not in use, as CiA 301 requires; synchronous RPDOs wait
// for SYNC.
#include "canopen/pdo.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"

namespace tandem::canopen {

namespace {

constexpr std::uint32_t kExtended = 0x3FFFF800;  // bit 29 and 29-bit identifiers, which we lack

enum ParameterSub : std::uint8_t { kCobId = 1, kType = 2, kInhibit = 3, kEvent = 5 };

}  // namespace

bool Pdo::add_to(ObjectDictionary& od, PdoDirection direction, int number, int node_id,
                 std::size_t max_bytes) {
  using namespace object;
  const bool receive = direction == PdoDirection::kReceive;
  const auto offset = static_cast<std::uint16_t>(number - 1);
  od_ = &od;
  max_bytes_ = max_bytes;
  direction_ = direction;
  parameter_index_ =
      static_cast<std::uint16_t>((receive ? kRpdoParameter : kTpdoParameter) + offset);
  default_cob_id_ = cob::kInvalid | (receive ? cob::rpdo(number, node_id)
                                             : cob::tpdo(number, node_id) | cob::kNoRtr);
  reset();
  const std::uint16_t p = parameter_index_;
  bool ok = od.add_value<std::uint8_t>(p, 0, receive ? kType : kEvent);
  ok = od.add(p, kCobId, cob_id_, kReadWrite, {}, this) && ok;
  ok = od.add(p, kType, type_, kReadWrite, {}, this) && ok;
  if (!receive) {
    ok = od.add(p, kInhibit, inhibit_100us_, kReadWrite, {}, this) && ok;
    ok = od.add(p, kEvent, event_ms_, kReadWrite, {}, this) && ok;
  }
  const auto m = static_cast<std::uint16_t>((receive ? kRpdoMapping : kTpdoMapping) + offset);
  ok = od.add(m, 0, count_, kReadWrite, {}, this) && ok;
  for (std::size_t i = 0; i < kMaxMappedObjects; ++i) {
    ok = od.add(m, static_cast<std::uint8_t>(i + 1), mapping_[i], kReadWrite, {}, this) && ok;
  }
  return ok;
}

void Pdo::reset() noexcept TANDEM_RT {
  cob_id_ = default_cob_id_;
  type_ = kEventProfile;
  inhibit_100us_ = 0;
  event_ms_ = 0;
  count_ = 0;
  mapping_.fill(0);
  resolve();
  restart();
}

AbortCode Pdo::check(const ObjectEntry& entry, const std::uint8_t* bytes) noexcept TANDEM_RT {
  return entry.index == parameter_index_ ? check_parameter(entry.sub, bytes)
                                         : check_mapping(entry.sub, bytes);
}

AbortCode Pdo::check_parameter(std::uint8_t sub,
                               const std::uint8_t* bytes) const noexcept TANDEM_RT {
  if (sub == kCobId) {
    const auto wanted = get<std::uint32_t>(bytes);
    const bool to_be_used = (wanted & cob::kInvalid) == 0;
    if ((wanted & kExtended) != 0) return AbortCode::kRange;
    if (to_be_used && cob::restricted(wanted & cob::kIdMask)) return AbortCode::kRange;
    const bool stays_in_use = in_use() && to_be_used;
    if (stays_in_use && (wanted & cob::kIdMask) != cob_id()) return AbortCode::kRange;
  }
  if (sub == kType && bytes[0] > 240 && bytes[0] < kEventManufacturer) return AbortCode::kRange;
  if (sub == kInhibit && in_use()) return AbortCode::kUnsupportedAccess;
  return AbortCode::kNone;
}

AbortCode Pdo::check_mapping(std::uint8_t sub, const std::uint8_t* bytes) const noexcept TANDEM_RT {
  if (in_use()) return AbortCode::kUnsupportedAccess;
  if (sub != 0) {
    return count_ != 0 ? AbortCode::kUnsupportedAccess : check_mapped(get<std::uint32_t>(bytes));
  }
  if (bytes[0] > kMaxMappedObjects) return AbortCode::kMappingTooLong;
  std::size_t bits = 0;
  for (std::size_t i = 0; i < bytes[0]; ++i) {
    const AbortCode code = check_mapped(mapping_[i]);
    if (code != AbortCode::kNone) return code;
    bits += mapping_[i] & 0xFF;
  }
  return bits > 8 * max_bytes_ ? AbortCode::kMappingTooLong : AbortCode::kNone;
}

AbortCode Pdo::check_mapped(std::uint32_t mapped) const noexcept TANDEM_RT {
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  const ObjectEntry* entry = od_->find(index, sub);
  if (entry == nullptr) return od_->exists(index, sub);
  const std::uint8_t wanted = direction_ == PdoDirection::kReceive ? kMapRpdo : kMapTpdo;
  if ((entry->access & wanted) == 0) return AbortCode::kNotMappable;
  return (mapped & 0xFF) == 8u * entry->size ? AbortCode::kNone : AbortCode::kNotMappable;
}

void Pdo::written(const ObjectEntry& entry) noexcept TANDEM_RT {
  if (entry.index != parameter_index_) {
    resolve();
  } else if (entry.sub == kCobId) {
    restart();
  }
}

void Pdo::resolve() noexcept TANDEM_RT {
  mapped_bytes_ = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const ObjectEntry* object = od_->find(static_cast<std::uint16_t>(mapping_[i] >> 16),
                                          static_cast<std::uint8_t>(mapping_[i] >> 8));
    copy_storage_[i] = {.data = object->data,
                        .offset = static_cast<std::uint8_t>(mapped_bytes_),
                        .size = static_cast<std::uint8_t>(object->size)};
    mapped_bytes_ += object->size;
  }
  copies_ = PdoCopies(std::span(copy_storage_).first(count_));
}

void Pdo::archive(Archive& ar) {
  ar(cob_id_, type_, count_, inhibit_100us_, event_ms_, mapping_);
  if (ar.reading() && ar.ok()) resolve();
}

RxPdo::Taken RxPdo::receive(const Frame& frame) noexcept TANDEM_RT {
  if (!in_use() || frame.id != cob_id()) return Taken::kNotMine;
  if (frame.length < mapped_bytes()) return Taken::kTooShort;
  if (!synchronous()) {
    apply(frame.data.data());
    return Taken::kApplied;
  }
  latched_ = frame.data;
  pending_ = true;
  return Taken::kLatched;
}

bool RxPdo::sync() noexcept TANDEM_RT {
  if (!pending_) return false;
  apply(latched_.data());
  pending_ = false;
  return true;
}

void RxPdo::apply(const std::uint8_t* bytes) noexcept { copies_.from_wire(bytes); }

void RxPdo::archive(Archive& ar) {
  Pdo::archive(ar);
  ar(pending_, latched_);
}

void TxPdo::sync(FrameSink& out) noexcept TANDEM_RT {
  if (!in_use() || !synchronous()) return;
  const bool due = type_ == kSynchronousAcyclic ? changed() : ++syncs_ >= type_;
  if (due) send(out);
}

void TxPdo::process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT {
  if (!in_use() || type_ < kEventManufacturer) return;  // 252, 253: when asked for
  since_sent_ns_ += dt_ns;
  if (since_sent_ns_ < inhibit_100us_ * (kNsPerMs / 10)) return;
  const bool timed = event_ms_ != 0 && since_sent_ns_ >= event_ms_ * kNsPerMs;
  if (timed || changed()) send(out);
}

bool TxPdo::answer_remote(std::uint32_t id, FrameSink& out) const noexcept TANDEM_RT {
  const bool asked = in_use() && allows_remote() && id == cob_id();
  if (!asked || mapped_bytes() > kClassicFrameBytes) return false;
  write(out);
  return true;
}

void TxPdo::write(FrameSink& out) const noexcept {
  Frame* frame = out.next();
  if (frame == nullptr) return;
  *frame = {};
  frame->id = cob_id();
  frame->length = frame_length(mapped_bytes());
  if (frame->length > kClassicFrameBytes) frame->flags = kFlagFd | kFlagBrs;
  copies_.to_wire(frame->data.data());
}

bool TxPdo::changed() const noexcept { return !sent_ || copies_.differ(last_.data()); }

void TxPdo::send(FrameSink& out) noexcept {
  write(out);
  if (!synchronous() || type_ == kSynchronousAcyclic) {
    copies_.to_wire(last_.data());
  }
  sent_ = true;
  syncs_ = 0;
  since_sent_ns_ = 0;
}

void TxPdo::restart() noexcept TANDEM_RT {
  sent_ = false;
  syncs_ = 0;
  since_sent_ns_ = INT64_MAX / 2;  // the inhibit time counts from a transmission
}

void TxPdo::archive(Archive& ar) {
  Pdo::archive(ar);
  ar(sent_, syncs_, since_sent_ns_, last_);
}

}  // namespace tandem::canopen
