// A controller that is loaded anew while it is at work: what it takes over from its former build.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "controllers/controller_io.hpp"
#include "runtime/input_port.hpp"

namespace tandem::runtime {

/// How a controller that was loaded anew goes on.
enum class Kept : std::uint8_t {
  kState,        ///< with the state of the former one
  kNotWanted,    ///< afresh: that was asked for
  kNoArchive,    ///< afresh: one of them has members, and no archive()
  kOtherClaims,  ///< afresh: it claims other joints, or in other modes
  kOtherState,   ///< afresh: its archive() has another shape
};

/// The state of one object for its successor. All its memory is there when it is made.
class CarriedState {
 public:
  /// @param as_configured  what the successor's archive() has written
  explicit CarriedState(const Archive& as_configured)
      : fresh_(as_configured.bytes()), given_(fresh_), taken_(as_configured.bytes().size()) {}

  /// Gives `next` the state of `former`.
  /// @return false: it has another shape, and `next` is as it was configured
  template <class Former, class Next>
  [[nodiscard]] bool take(Former& former, Next& next) noexcept TANDEM_RT {
    taken_.clear();
    former.archive(taken_);
    const bool fits = taken_.ok() && taken_.bytes().size() == fresh_.bytes().size();
    if (fits && give(next)) return true;
    given_ = fresh_;
    next.archive(given_);
    return false;
  }
  /// Gives `next` once more what take() has taken.
  template <class Next>
  bool give(Next& next) noexcept TANDEM_RT {
    given_ = fresh_;
    if (const std::size_t size = taken_.bytes().size(); size > 0) {
      // Its own bytes, which are no constants: an Archive is filled in place.
      std::memcpy(const_cast<std::byte*>(given_.bytes().data()), taken_.bytes().data(), size);
    }
    next.archive(given_);
    return given_.ok() && given_.at_end();
  }

 private:
  Archive fresh_, given_;  // to read: as configured; what is read now
  Archive taken_;          // bounded
};

/// A block of plain words, of which the successor's gets the parts that both have.
class CarriedWords {
 public:
  /// Bytes of the former block, and where they go.
  struct Part {
    std::size_t from = 0, to = 0, size = 0;
  };
  /// @param as_configured  what the successor's block has written
  CarriedWords(const Archive& as_configured, std::vector<Part> parts)
      : fresh_(as_configured.bytes()), given_(fresh_), parts_(std::move(parts)) {}

  /// @param now  what the successor's block holds: the rest of it stays
  template <class Block>
  void carry(std::span<const std::byte> former, std::span<const std::byte> now,
             Block& next) noexcept TANDEM_RT {
    if (parts_.empty()) return;
    given_ = fresh_;
    // Its own bytes, which are no constants: an Archive is filled in place.
    auto* const to = const_cast<std::byte*>(given_.bytes().data());
    std::memcpy(to, now.data(), now.size());
    for (const Part& part : parts_) std::memcpy(to + part.to, former.data() + part.from, part.size);
    next.archive(given_);
  }

 private:
  Archive fresh_, given_;  // to read: as configured; what is read now
  std::vector<Part> parts_;
};

/// What a controller that was loaded anew takes over. What it declared goes over by name, whatever
/// else it declares.
struct Succession {
  CarriedState controller;
  CarriedWords signals, marks;
  /// That are the same in both: the former build's, its own.
  std::vector<std::pair<const InputPort*, InputPort*>> inputs{};
  /// Live ones that mean the same: the former build's, its own.
  std::vector<std::pair<const ParameterRow*, ParameterRow*>> parameters{};
  bool wanted = true;  ///< false: nothing of the controller's own
  Kept kept = Kept::kState;
};

}  // namespace tandem::runtime
