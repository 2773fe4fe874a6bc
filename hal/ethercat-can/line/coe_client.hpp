// SDO transfers with one slave through its mailboxes: one at a time, expedited or in segments.
// Layer: hal/ethercat-can/line.  Thread: RT; construction non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/abort_code.hpp"
#include "ethercat/mailbox.hpp"
#include "ethercat/sii.hpp"
#include "hal/ethercat-can/line/exchange.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

/// The longest value that can be read or written.
inline constexpr std::size_t kMaxSdoBytes = 1024;

/// Writes a request, looks whether the mailbox is full, reads the answer; asks for it again when
/// the frame with it was lost. Strange and late messages are passed over.
class CoeClient {
 public:
  enum class Status : std::uint8_t {
    kIdle,
    kBusy,
    kDone,     ///< value() has what was read
    kAborted,  ///< abort_code() says why
  };
  /// How long one message may wait for its answer.
  static constexpr std::int64_t kAnswerNs = 1'000'000'000;

  /// Forgets everything: the slave is in INIT, or was.
  void reset(std::uint16_t station, const ethercat::sii::Mailbox& mailbox) noexcept TANDEM_RT;
  /// Begins to read. A transfer under way is forgotten.
  void upload(std::uint16_t index, std::uint8_t sub) noexcept TANDEM_RT;
  /// Begins to write. @pre value.size() is 1 to kMaxSdoBytes
  void download(std::uint16_t index, std::uint8_t sub,
                std::span<const std::uint8_t> value) noexcept TANDEM_RT;
  /// Goes on, with the channel for itself while busy().
  void process(std::int64_t now_ns, Exchange& exchange, std::size_t channel) noexcept TANDEM_RT;

  [[nodiscard]] bool busy() const noexcept { return status_ == Status::kBusy; }
  [[nodiscard]] Status status() const noexcept { return status_; }
  [[nodiscard]] canopen::AbortCode abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] std::span<const std::uint8_t> value() const noexcept {
    return {buffer_.data(), length_};
  }
  void archive(Archive& ar);
  /// The last emergency message that was in the mailbox: error code, register and five bytes as in
  /// CiA 301's; error code 0: none, or the error is over.
  [[nodiscard]] std::span<const std::uint8_t, 8> emergency() const noexcept { return emergency_; }
  [[nodiscard]] std::uint32_t emergencies() const noexcept { return emergencies_; }

 private:
  enum class Step : std::uint8_t { kWrite, kLook, kRead, kAskAgain, kWaitAgain };
  using Bytes = std::span<const std::uint8_t>;

  void begin(std::uint16_t index, std::uint8_t sub, bool uploading) noexcept;
  void post(std::size_t bytes) noexcept;
  void ask(Exchange& exchange, std::size_t channel) noexcept;
  void answered(const DatagramRequest& request) noexcept;
  void lost() noexcept;
  void take(Bytes message) noexcept;
  void take_response(Bytes message) noexcept;
  void take_upload(Bytes message) noexcept;
  void take_segment(Bytes message) noexcept;
  void send_download() noexcept;
  void send_segment() noexcept;
  void ask_segment() noexcept;
  void abort(canopen::AbortCode code) noexcept;

  std::uint16_t station_ = 0;
  ethercat::sii::Mailbox mailbox_;
  Status status_ = Status::kIdle;
  Step step_ = Step::kWrite;
  bool uploading_ = false;
  bool segments_ = false;
  bool toggle_ = false;
  bool repeat_ = false;       ///< the bit by which an answer is asked for again
  std::uint8_t counter_ = 0;  ///< of our messages
  std::uint8_t sub_ = 0;
  std::uint16_t index_ = 0;
  std::array<std::uint8_t, 8> emergency_{};
  std::uint32_t emergencies_ = 0;
  canopen::AbortCode abort_code_ = canopen::AbortCode::kNone;
  std::size_t expected_ = 0;
  std::size_t length_ = 0;
  std::size_t position_ = 0;
  std::int64_t since_ns_ = -1;  ///< of the message; -1: not looked at yet
  std::array<std::uint8_t, kMaxSdoBytes> buffer_{};
  std::array<std::uint8_t, ethercat::kMaxMailboxBytes> message_{};
};

}  // namespace tandem::hal::ecat
