// A node's process data objects: parameters 1400/1800, mapping 1600/1A00, packing of the bytes.
// Layer: canopen.  Thread: the one that owns the node.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "canopen/pdo_copy.hpp"

namespace tandem::canopen {

inline constexpr std::size_t kMaxMappedObjects = 32;

/// One entry of a mapping as 1600 and 1A00 hold it: index << 16 | sub << 8 | bits.
[[nodiscard]] constexpr std::uint32_t mapping_entry(std::uint16_t index, std::uint8_t sub,
                                                    std::size_t bytes) noexcept {
  return (std::uint32_t{index} << 16) | (std::uint32_t{sub} << 8) |
         static_cast<std::uint32_t>(8 * bytes);
}

enum class PdoDirection : std::uint8_t { kReceive, kTransmit };

/// What RPDO and TPDO share: the communication parameters, and the mapping with its procedure:
/// (1) set bit 31 of the COB-ID, (2) count 0, (3) write the entries, (4) count n, (5) clear bit 31.
/// Anything else that would change a PDO in use is refused.
class Pdo : public ObjectOwner {
 public:
  /// Adds the PDO's objects to `od`. Nothing is mapped and the PDO is not in use.
  /// @param number     1 to kPdosPerNode
  /// @param max_bytes  that a frame of the bus carries; a longer mapping is refused
  /// @return false when `od` is full.
  bool add_to(ObjectDictionary& od, PdoDirection direction, int number, int node_id,
              std::size_t max_bytes = kMaxFrameBytes);
  /// Power-on values.
  void reset() noexcept TANDEM_RT;

  [[nodiscard]] bool in_use() const noexcept { return (cob_id_ & cob::kInvalid) == 0; }
  [[nodiscard]] std::uint32_t cob_id() const noexcept { return cob_id_ & cob::kIdMask; }
  [[nodiscard]] bool synchronous() const noexcept { return type_ <= 240; }
  /// A TPDO's bit 30 is clear: a remote request asks for it.
  [[nodiscard]] bool allows_remote() const noexcept { return (cob_id_ & cob::kNoRtr) == 0; }
  /// Bytes mapped, not rounded up to a frame's length.
  [[nodiscard]] std::size_t mapped_bytes() const noexcept { return mapped_bytes_; }

  /// Forgets what is pending: the PDO comes into use.
  virtual void restart() noexcept TANDEM_RT = 0;
  void archive(Archive& ar);

  AbortCode check(const ObjectEntry& entry, const std::uint8_t* bytes) noexcept TANDEM_RT override;
  void written(const ObjectEntry& entry) noexcept TANDEM_RT override;

 protected:
  ~Pdo() = default;

  std::uint8_t type_ = kEventProfile;
  std::uint8_t count_ = 0;
  std::uint16_t inhibit_100us_ = 0;
  std::uint16_t event_ms_ = 0;

 private:
  std::uint32_t cob_id_ = cob::kInvalid;
  std::size_t mapped_bytes_ = 0;

 protected:             // what every frame needs stands side by side
  PdoCopies copies_{};  ///< the mapping, compiled

 private:
  AbortCode check_parameter(std::uint8_t sub, const std::uint8_t* bytes) const noexcept TANDEM_RT;
  AbortCode check_mapping(std::uint8_t sub, const std::uint8_t* bytes) const noexcept TANDEM_RT;
  AbortCode check_mapped(std::uint32_t mapped) const noexcept TANDEM_RT;
  void resolve() noexcept TANDEM_RT;

  const ObjectDictionary* od_ = nullptr;
  PdoDirection direction_ = PdoDirection::kReceive;
  std::uint16_t parameter_index_ = 0;
  std::uint32_t default_cob_id_ = cob::kInvalid;
  std::size_t max_bytes_ = kMaxFrameBytes;
  std::array<std::uint32_t, kMaxMappedObjects> mapping_{};
  std::array<PdoCopy, kMaxMappedObjects> copy_storage_{};
};

/// Master to node. A synchronous one takes effect at the next SYNC, the others at once.
class RxPdo final : public Pdo {
 public:
  enum class Taken : std::uint8_t {
    kNotMine,
    kLatched,   ///< waits for the next SYNC
    kApplied,   ///< the objects have their new values
    kTooShort,  ///< fewer bytes than mapped: not processed
  };
  Taken receive(const Frame& frame) noexcept TANDEM_RT;
  /// Applies what waits. @return true when something did.
  bool sync() noexcept TANDEM_RT;
  void restart() noexcept TANDEM_RT override { pending_ = false; }
  void archive(Archive& ar);

 private:
  void apply(const std::uint8_t* bytes) noexcept;

  bool pending_ = false;
  std::array<std::uint8_t, kMaxFrameBytes> latched_{};
};

/// Node to master. The event of types 0, 254 and 255 is a change of a mapped value since it was
/// sent last; the first values after the PDO came into use are one.
class TxPdo final : public Pdo {
 public:
  /// At a SYNC, after the application has sampled: sends what is due (types 0 to 240).
  void sync(FrameSink& out) noexcept TANDEM_RT;
  /// Types 254 and 255: sends at an event or when the event timer says so, and not before the
  /// inhibit time has passed.
  void process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT;
  /// A remote request for identifier `id`: sends the values of now.
  /// @return false when it asks for another PDO, for one that forbids it (bit 30), or for one that
  ///         only CAN FD carries, which has no remote requests.
  bool answer_remote(std::uint32_t id, FrameSink& out) const noexcept TANDEM_RT;
  void restart() noexcept TANDEM_RT override;
  void archive(Archive& ar);

 private:
  void write(FrameSink& out) const noexcept;
  [[nodiscard]] bool changed() const noexcept;
  void send(FrameSink& out) noexcept;

  bool sent_ = false;  ///< since it came into use
  std::uint8_t syncs_ = 0;
  std::array<std::uint8_t, kMaxFrameBytes> last_{};  ///< sent
  std::int64_t since_sent_ns_ = 0;
};

}  // namespace tandem::canopen
