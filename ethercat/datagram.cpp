// Reading never looks beyond the frame; writing never beyond its buffer.
#include "ethercat/datagram.hpp"

#include <algorithm>

namespace tandem::ethercat {

namespace {

constexpr std::uint16_t kLengthMask = 0x07FF;
constexpr std::uint16_t kTypeCommands = 0x1000;
constexpr std::uint16_t kTypeMask = 0xF000;
constexpr std::uint8_t kMore = 0x80;  // of the second byte of the length

}  // namespace

const char* to_string(Command command) noexcept {
  static constexpr std::array<const char*, kCommands> kNames{
      "NOP", "APRD", "APWR", "APRW", "FPRD", "FPWR", "FPRW", "BRD",
      "BWR", "BRW",  "LRD",  "LWR",  "LRW",  "ARMW", "FRMW"};
  const auto number = static_cast<std::size_t>(command);
  return number < kNames.size() ? kNames[number] : "?";
}

FrameReader::FrameReader(std::span<std::uint8_t> frame) noexcept TANDEM_RT {
  if (frame.size() < kFrameHeaderBytes) {
    refuse(LineError::kTooShort);
    return;
  }
  if (frame.size() > kMaxFrameBytes) {
    refuse(LineError::kTooLong);
    return;
  }
  if (frame[12] != (kEtherType >> 8) || frame[13] != (kEtherType & 0xFF)) {
    refuse(LineError::kNotEtherCat);
    return;
  }
  const auto header = canopen::get<std::uint16_t>(&frame[kEthernetHeaderBytes]);
  const std::size_t length = header & kLengthMask;
  if ((header & kTypeMask) != kTypeCommands) {
    refuse(LineError::kNotCommands);
    return;
  }
  if (length < kDatagramOverhead || length > frame.size() - kFrameHeaderBytes) {
    refuse(LineError::kLength);
    return;
  }
  left_ = frame.subspan(kFrameHeaderBytes, length);
  more_ = true;
}

bool FrameReader::refuse(LineError error) noexcept {
  error_ = error;
  left_ = {};
  more_ = false;
  return false;
}

bool FrameReader::next(Datagram& datagram) noexcept TANDEM_RT {
  if (!more_) return left_.empty() ? false : refuse(LineError::kTrailing);
  if (left_.empty()) return refuse(LineError::kMissing);
  if (left_.size() < kDatagramOverhead) return refuse(LineError::kTruncated);
  if (left_[0] >= kCommands) return refuse(LineError::kCommand);
  const std::size_t length = canopen::get<std::uint16_t>(&left_[6]) & kLengthMask;
  if (length + kDatagramOverhead > left_.size()) return refuse(LineError::kTruncated);
  datagram = Datagram(left_.first(length + kDatagramOverhead));
  left_ = left_.subspan(length + kDatagramOverhead);
  more_ = datagram.more();
  return true;
}

LineError check_frame(std::span<std::uint8_t> frame) noexcept TANDEM_RT {
  FrameReader reader(frame);
  Datagram datagram;
  while (reader.next(datagram)) {
  }
  return reader.error();
}

void FrameWriter::begin(std::span<std::uint8_t> buffer,
                        const MacAddress& source) noexcept TANDEM_RT {
  buffer_ = buffer.first(std::min(buffer.size(), kMaxFrameBytes));
  used_ = kFrameHeaderBytes;
  last_ = 0;
  std::fill_n(buffer_.begin(), source.size(), std::uint8_t{0xFF});
  std::ranges::copy(source, buffer_.begin() + 6);
  buffer_[12] = kEtherType >> 8;
  buffer_[13] = kEtherType & 0xFF;
}

bool FrameWriter::fits(std::size_t length) const noexcept TANDEM_RT {
  return length <= kMaxDatagramData && used_ + length + kDatagramOverhead <= buffer_.size();
}

std::span<std::uint8_t> FrameWriter::add(Command command, std::uint8_t index, std::uint32_t address,
                                         std::size_t length) noexcept TANDEM_RT {
  if (!fits(length)) return {};
  if (last_ != 0) buffer_[last_ + 7] |= kMore;
  last_ = used_;
  std::uint8_t* at = &buffer_[used_];
  std::fill_n(at, length + kDatagramOverhead, std::uint8_t{0});
  at[0] = static_cast<std::uint8_t>(command);
  at[1] = index;
  canopen::put(at + 2, address);
  canopen::put(at + 6, static_cast<std::uint16_t>(length));
  used_ += length + kDatagramOverhead;
  return buffer_.subspan(last_ + kDatagramHeaderBytes, length);
}

std::size_t FrameWriter::finish() noexcept TANDEM_RT {
  const auto length = static_cast<std::uint16_t>(used_ - kFrameHeaderBytes);
  canopen::put(&buffer_[kEthernetHeaderBytes], static_cast<std::uint16_t>(length | kTypeCommands));
  const std::size_t size = std::max(used_, kMinFrameBytes);
  std::fill(buffer_.begin() + static_cast<std::ptrdiff_t>(used_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(size), std::uint8_t{0});
  return size;
}

}  // namespace tandem::ethercat
