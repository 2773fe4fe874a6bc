// One transfer at a time, expedited or segmented, as a state machine on received frames and elapsed
// time.
#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"
#include "canopen/sdo.hpp"
#include "canopen/sdo_bytes.hpp"

namespace tandem::canopen {

namespace {

constexpr std::uint8_t kUploadSegmentAnswer = 0;
constexpr std::uint8_t kDownloadSegmentAnswer = 1;
constexpr std::uint8_t kInitiateUploadAnswer = 2;
constexpr std::uint8_t kInitiateDownloadAnswer = 3;

}  // namespace

void SdoClient::start(std::uint16_t index, std::uint8_t sub, bool uploading) noexcept {
  status_ = Status::kBusy;
  abort_code_ = AbortCode::kNone;
  uploading_ = uploading;
  segmented_ = false;
  toggle_ = false;
  index_ = index;
  sub_ = sub;
  announced_ = 0;
  length_ = 0;
  position_ = 0;
  idle_ns_ = 0;
}

void SdoClient::download(std::uint16_t index, std::uint8_t sub, std::span<const std::uint8_t> value,
                         FrameSink& out) noexcept TANDEM_RT {
  start(index, sub, false);
  length_ = std::min(value.size(), kMaxSdoBytes);
  std::copy_n(value.data(), length_, buffer_.data());
  if (length_ > kExpeditedBytes) {
    Frame frame = initiate_request(0x20 | kSizeGiven);
    put(&frame.data[4], static_cast<std::uint32_t>(length_));
    out.push(frame);
    return;
  }
  Frame frame = initiate_request(static_cast<std::uint8_t>(
      0x20 | ((kExpeditedBytes - length_) << 2) | kExpedited | kSizeGiven));
  std::copy_n(buffer_.data(), length_, &frame.data[4]);
  out.push(frame);
}

void SdoClient::upload(std::uint16_t index, std::uint8_t sub, FrameSink& out) noexcept TANDEM_RT {
  start(index, sub, true);
  out.push(initiate_request(0x40));
}

/// Drives answer late, twice, and what nobody asked for: only the answer that is waited for counts.
bool SdoClient::answers(const Frame& frame) const noexcept {
  const auto mine = cob::kSdoResponse + static_cast<std::uint32_t>(node_);
  if (frame.id != mine || frame.length <= kExpeditedBytes) return false;
  const std::uint8_t answer = frame.data[0] >> 5;
  const bool whole = frame.length == kClassicFrameBytes;
  if (segmented_ && answer != kAbort) {
    return whole && answer == (uploading_ ? kUploadSegmentAnswer : kDownloadSegmentAnswer);
  }
  const bool expected =
      answer == kAbort || answer == (uploading_ ? kInitiateUploadAnswer : kInitiateDownloadAnswer);
  // An expedited answer may end with its value; every other kind has eight bytes.
  const bool expedited = answer == kInitiateUploadAnswer && (frame.data[0] & kExpedited) != 0;
  return expected && (whole || expedited) && get<std::uint16_t>(&frame.data[1]) == index_ &&
         frame.data[3] == sub_;
}

void SdoClient::receive(const Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  if (status_ != Status::kBusy || !answers(frame)) return;
  idle_ns_ = 0;
  if (frame.data[0] >> 5 == kAbort) {
    status_ = Status::kAborted;
    abort_code_ = static_cast<AbortCode>(get<std::uint32_t>(&frame.data[4]));
  } else if (uploading_) {
    on_upload(frame, out);
  } else {
    on_download(frame, out);
  }
}

void SdoClient::on_download(const Frame& frame, FrameSink& out) noexcept {
  const std::uint8_t command = frame.data[0];
  if (!segmented_) {
    if (length_ <= kExpeditedBytes) {
      status_ = Status::kDone;
      return;
    }
    segmented_ = true;
    return send_download_segment(out);
  }
  if (((command & kToggleBit) != 0) != toggle_) return fail(AbortCode::kToggle, out);
  if (position_ == length_) {
    status_ = Status::kDone;
    return;
  }
  toggle_ = !toggle_;
  send_download_segment(out);
}

void SdoClient::send_download_segment(FrameSink& out) noexcept {
  const std::size_t size = std::min(kSegmentBytes, length_ - position_);
  const bool last = position_ + size == length_;
  Frame frame = request(static_cast<std::uint8_t>(
      (toggle_ ? kToggleBit : 0) | ((kSegmentBytes - size) << 1) | (last ? kLast : 0)));
  std::copy_n(&buffer_[position_], size, &frame.data[1]);
  position_ += size;
  out.push(frame);
}

void SdoClient::on_upload(const Frame& frame, FrameSink& out) noexcept {
  if (segmented_) return on_upload_segment(frame, out);
  const std::uint8_t command = frame.data[0];
  if ((command & kExpedited) != 0) {
    const std::size_t there = frame.length - kExpeditedBytes;
    length_ = std::min(
        there, (command & kSizeGiven) != 0 ? kExpeditedBytes - ((command >> 2) & 3u) : there);
    std::copy_n(&frame.data[4], length_, buffer_.data());
    status_ = Status::kDone;
    return;
  }
  announced_ = (command & kSizeGiven) != 0 ? get<std::uint32_t>(&frame.data[4]) : 0;
  if (announced_ > kMaxSdoBytes) return fail(AbortCode::kOutOfMemory, out);
  segmented_ = true;
  out.push(request(0x60));
}

void SdoClient::on_upload_segment(const Frame& frame, FrameSink& out) noexcept {
  const std::uint8_t command = frame.data[0];
  if (((command & kToggleBit) != 0) != toggle_) return fail(AbortCode::kToggle, out);
  const std::size_t size = kSegmentBytes - ((command >> 1) & 7u);
  if (length_ + size > kMaxSdoBytes) return fail(AbortCode::kOutOfMemory, out);
  std::copy_n(&frame.data[1], size, &buffer_[length_]);
  length_ += size;
  if ((command & kLast) != 0) {
    if (announced_ != 0 && announced_ != length_) return fail(AbortCode::kLength, out);
    status_ = Status::kDone;
    return;
  }
  toggle_ = !toggle_;
  out.push(request(static_cast<std::uint8_t>(0x60 | (toggle_ ? kToggleBit : 0))));
}

void SdoClient::process(std::int64_t dt_ns, std::int64_t timeout_ns,
                        FrameSink& out) noexcept TANDEM_RT {
  if (status_ != Status::kBusy) return;
  idle_ns_ += dt_ns;
  if (idle_ns_ >= timeout_ns) fail(AbortCode::kTimeout, out);
}

void SdoClient::fail(AbortCode code, FrameSink& out) noexcept {
  status_ = Status::kAborted;
  abort_code_ = code;
  Frame frame = initiate_request(0x80);
  put(&frame.data[4], static_cast<std::uint32_t>(code));
  out.push(frame);
}

Frame SdoClient::request(std::uint8_t command) const noexcept {
  return sdo_frame(cob::kSdoRequest, node_, command);
}

Frame SdoClient::initiate_request(std::uint8_t command) const noexcept {
  return sdo_frame(cob::kSdoRequest, node_, command, index_, sub_);
}

void SdoClient::archive(Archive& ar) {
  ar(status_, uploading_, segmented_, toggle_, index_, sub_, abort_code_, announced_, length_,
     position_, idle_ns_, buffer_);
}

}  // namespace tandem::canopen
