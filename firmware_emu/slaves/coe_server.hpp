// The CoE SDO server of an emulated slave, over an object dictionary.
// Layer: firmware_emu.  Thread: the line's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/object_dictionary.hpp"
#include "ethercat/mailbox.hpp"

namespace tandem::firmware::esc {

/// The longest value that can be transferred.
inline constexpr std::size_t kMaxCoeBytes = 1024;

/// One transfer at a time: expedited, normal, or in segments when it does not fit the mailbox.
class CoeServer {
 public:
  /// @param application   answers for objects that are not in `od`
  /// @param answer_bytes  size of the mailbox to the master, kMinMailboxBytes to kMaxMailboxBytes
  CoeServer(canopen::ObjectDictionary& od, canopen::ObjectDictionary& application,
            std::size_t answer_bytes) noexcept
      : own_(&od), application_(&application), answer_bytes_(answer_bytes) {}
  CoeServer(canopen::ObjectDictionary& od, std::size_t answer_bytes) noexcept
      : CoeServer(od, od, answer_bytes) {}

  /// Answers a message of the master.
  /// @param request  the mailbox's bytes, what follows the message included
  /// @param out      at least kMaxMailboxBytes
  /// @return bytes of the answer in `out`; 0: there is none
  [[nodiscard]] std::size_t answer(std::span<const std::uint8_t> request,
                                   std::span<std::uint8_t> out) noexcept TANDEM_RT;
  /// Forgets a transfer under way.
  void reset() noexcept { transfer_ = Transfer::kNone; }
  void archive(Archive& ar);

 private:
  enum class Transfer : std::uint8_t { kNone, kDownload, kUpload };
  using Bytes = std::span<const std::uint8_t>;
  using Out = std::span<std::uint8_t>;

  std::size_t sdo(Bytes message, Out out) noexcept;
  std::size_t download(Bytes message, Out out) noexcept;
  std::size_t download_segment(Bytes message, Out out) noexcept;
  std::size_t upload(Out out) noexcept;
  std::size_t upload_segment(Bytes message, Out out) noexcept;
  std::size_t abort(canopen::AbortCode code, Out out) noexcept;
  std::size_t respond(Out out, std::uint8_t command, std::size_t bytes) noexcept;
  std::size_t refuse(ethercat::MailboxError error, Out out) noexcept;
  std::size_t refuse_information(Out out) noexcept;

  [[nodiscard]] canopen::ObjectDictionary& dictionary() const noexcept {
    const bool own = own_->exists(index_, sub_) != canopen::AbortCode::kNoObject;
    return own ? *own_ : *application_;
  }

  canopen::ObjectDictionary* own_;
  canopen::ObjectDictionary* application_;
  std::size_t answer_bytes_;
  Transfer transfer_ = Transfer::kNone;
  bool toggle_ = false;
  std::uint8_t counter_ = 0;  ///< of our messages
  std::uint8_t sub_ = 0;
  std::uint16_t index_ = 0;
  std::size_t expected_ = 0;  ///< bytes of a download, announced
  std::size_t length_ = 0;    ///< bytes in buffer_
  std::size_t position_ = 0;  ///< of them sent
  std::array<std::uint8_t, kMaxCoeBytes> buffer_{};
};

}  // namespace tandem::firmware::esc
