// Bit counts of ISO 11898-1:2015: dynamic stuffing of a classic frame and of FD's arbitration
// phase, fixed stuff bits in FD's CRC field.
#include "hal/ethercat-can/frame_time.hpp"

namespace tandem::hal::can {
namespace {

/// The code of a length in a frame: 0 to 8, then FD's steps.
unsigned length_code(std::size_t length) noexcept {
  if (length <= canopen::kClassicFrameBytes) return static_cast<unsigned>(length);
  unsigned code = 9;
  for (const std::size_t step : {12U, 16U, 20U, 24U, 32U, 48U}) {
    if (length <= step) return code;
    ++code;
  }
  return code;
}

/// Counts bits as they go by: the stuff bits that they need, and the CRC of a classic frame.
class BitCounter {
 public:
  void put(unsigned value, int bits) noexcept {
    for (int i = bits - 1; i >= 0; --i) put_bit((value >> i) & 1U);
  }
  /// A bit on the wire, and the stuff bit after it when it is the fifth alike.
  void put_bit(unsigned bit) noexcept {
    ++count_;
    const bool feedback = bit != ((crc_ >> (wire::kClassicCrc - 1)) & 1U);
    crc_ = (crc_ << 1) & kCrcMask;
    if (feedback) crc_ ^= kCrcPolynomial;
    // The stuff bit is owed until it is known whether a stuffed bit follows.
    if (owed_) stuff();
    run_ = run_ > 0 && bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    owed_ = run_ == kMostAlike;
  }
  /// The fifth bit alike is the last: a stuff bit all the same.
  void settle() noexcept {
    if (owed_) stuff();
  }
  [[nodiscard]] unsigned crc() const noexcept { return crc_; }
  [[nodiscard]] int count() const noexcept { return count_; }

 private:
  static constexpr int kMostAlike = 5;
  static constexpr unsigned kCrcPolynomial = 0x4599;
  static constexpr unsigned kCrcMask = 0x7FFF;

  void stuff() noexcept {
    ++count_;
    last_ ^= 1U;  // the stuff bit is the other value, and begins a run
    run_ = 1;
    owed_ = false;
  }

  unsigned crc_ = 0;
  unsigned last_ = 0;
  int run_ = 0;
  int count_ = 0;
  bool owed_ = false;
};

}  // namespace

FrameBits exact_frame_bits(const canopen::Frame& frame) noexcept TANDEM_RT {
  BitCounter bits;
  bits.put(0, 1);  // SOF
  bits.put(frame.id & 0x7FFU, 11);
  if (!frame.fd()) {
    bits.put(0, 3);  // RTR, IDE, FDF
    bits.put(length_code(frame.length), 4);
    for (const std::uint8_t byte : frame.payload()) bits.put(byte, 8);
    bits.put(bits.crc(), wire::kClassicCrc);
    bits.settle();
    return {.nominal = bits.count() + wire::kTail, .data = 0};
  }
  const bool switched = (frame.flags & canopen::kFlagBrs) != 0;
  bits.put(switched ? 0b00101U : 0b00100U, 5);  // RRS, IDE, FDF, res, BRS
  const int arbitration = bits.count();
  bits.put(0, 1);  // ESI: error active
  bits.put(length_code(frame.length), 4);
  for (const std::uint8_t byte : frame.payload()) bits.put(byte, 8);
  // A stuff bit that is still owed is the CRC field's first fixed one.
  const int rest = bits.count() - arbitration + wire::fd_crc_field(frame.length);
  return switched ? FrameBits{.nominal = arbitration + wire::kTail, .data = rest}
                  : FrameBits{.nominal = arbitration + rest + wire::kTail, .data = 0};
}

}  // namespace tandem::hal::can
