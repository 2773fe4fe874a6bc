// Answers each request frame: expedited and segmented transfers, abort codes, 500 ms time-out; no
// block transfer.
#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"
#include "canopen/sdo.hpp"
#include "canopen/sdo_bytes.hpp"

namespace tandem::canopen {

namespace {

constexpr std::uint8_t kDownloadSegment = 0;
constexpr std::uint8_t kInitiateDownload = 1;
constexpr std::uint8_t kInitiateUpload = 2;
constexpr std::uint8_t kUploadSegment = 3;

}  // namespace

void SdoServer::receive(const Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  const auto mine = cob::kSdoRequest + static_cast<std::uint32_t>(node_);
  if (frame.id != mine || frame.length != kClassicFrameBytes) return;
  idle_ns_ = 0;
  switch (frame.data[0] >> 5) {
    case kInitiateDownload: begin_download(frame, out); break;
    case kInitiateUpload: begin_upload(frame, out); break;
    case kDownloadSegment: download_segment(frame, out); break;
    case kUploadSegment: upload_segment(frame, out); break;
    case kAbort: transfer_ = Transfer::kNone; break;
    default:
      index_ = get<std::uint16_t>(&frame.data[1]);
      sub_ = frame.data[3];
      abort(AbortCode::kBadCommand, out);
      break;
  }
}

void SdoServer::begin_download(const Frame& request, FrameSink& out) noexcept {
  const std::uint8_t command = request.data[0];
  index_ = get<std::uint16_t>(&request.data[1]);
  sub_ = request.data[3];
  transfer_ = Transfer::kNone;
  const ObjectEntry* entry = od_->find(index_, sub_);
  if (entry == nullptr) return abort(od_->exists(index_, sub_), out);
  if ((entry->access & kWrite) == 0) return abort(AbortCode::kReadOnly, out);
  if ((command & kExpedited) != 0) {
    std::size_t size = 4;
    if ((command & kSizeGiven) != 0) {
      size = 4u - ((command >> 2) & 3u);
    } else {
      size = std::min<std::size_t>(size, entry->size);
    }
    const AbortCode code = od_->write(index_, sub_, {&request.data[4], size});
    if (code != AbortCode::kNone) return abort(code, out);
  } else {
    announced_ = (command & kSizeGiven) != 0 ? get<std::uint32_t>(&request.data[4]) : 0;
    if (announced_ > kMaxSdoBytes) return abort(AbortCode::kTooLong, out);
    transfer_ = Transfer::kDownload;
    toggle_ = false;
    length_ = 0;
  }
  out.push(initiate_response(0x60));
}

void SdoServer::download_segment(const Frame& request, FrameSink& out) noexcept {
  const std::uint8_t command = request.data[0];
  if (transfer_ != Transfer::kDownload) return abort(AbortCode::kBadCommand, out);
  if (((command & kToggleBit) != 0) != toggle_) return abort(AbortCode::kToggle, out);
  const std::size_t size = kSegmentBytes - ((command >> 1) & 7u);
  if (length_ + size > kMaxSdoBytes) return abort(AbortCode::kTooLong, out);
  std::copy_n(&request.data[1], size, &buffer_[length_]);
  length_ += size;
  if ((command & kLast) != 0) {
    if (announced_ != 0 && announced_ != length_) return abort(AbortCode::kLength, out);
    const AbortCode code = od_->write(index_, sub_, {buffer_.data(), length_});
    if (code != AbortCode::kNone) return abort(code, out);
    transfer_ = Transfer::kNone;
  }
  out.push(response(static_cast<std::uint8_t>(0x20 | (toggle_ ? kToggleBit : 0))));
  toggle_ = !toggle_;
}

void SdoServer::begin_upload(const Frame& request, FrameSink& out) noexcept {
  index_ = get<std::uint16_t>(&request.data[1]);
  sub_ = request.data[3];
  transfer_ = Transfer::kNone;
  const AbortCode code = od_->read(index_, sub_, buffer_, length_);
  if (code != AbortCode::kNone) return abort(code, out);
  if (length_ >= 1 && length_ <= 4) {
    Frame frame = initiate_response(
        static_cast<std::uint8_t>(0x40 | ((4 - length_) << 2) | kExpedited | kSizeGiven));
    std::copy_n(buffer_.data(), length_, &frame.data[4]);
    out.push(frame);
    return;
  }
  transfer_ = Transfer::kUpload;
  toggle_ = false;
  position_ = 0;
  Frame frame = initiate_response(0x40 | kSizeGiven);
  put(&frame.data[4], static_cast<std::uint32_t>(length_));
  out.push(frame);
}

void SdoServer::upload_segment(const Frame& request, FrameSink& out) noexcept {
  if (transfer_ != Transfer::kUpload) return abort(AbortCode::kBadCommand, out);
  if (((request.data[0] & kToggleBit) != 0) != toggle_) return abort(AbortCode::kToggle, out);
  const std::size_t size = std::min(kSegmentBytes, length_ - position_);
  const bool last = position_ + size == length_;
  Frame frame = response(static_cast<std::uint8_t>(
      (toggle_ ? kToggleBit : 0) | ((kSegmentBytes - size) << 1) | (last ? kLast : 0)));
  std::copy_n(&buffer_[position_], size, &frame.data[1]);
  position_ += size;
  toggle_ = !toggle_;
  if (last) transfer_ = Transfer::kNone;
  out.push(frame);
}

void SdoServer::process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT {
  if (transfer_ == Transfer::kNone) return;
  idle_ns_ += dt_ns;
  if (idle_ns_ >= kSdoTimeoutNs) abort(AbortCode::kTimeout, out);
}

void SdoServer::abort(AbortCode code, FrameSink& out) noexcept {
  transfer_ = Transfer::kNone;
  Frame frame = initiate_response(0x80);
  put(&frame.data[4], static_cast<std::uint32_t>(code));
  out.push(frame);
}

Frame SdoServer::response(std::uint8_t command) const noexcept {
  return sdo_frame(cob::kSdoResponse, node_, command);
}

Frame SdoServer::initiate_response(std::uint8_t command) const noexcept {
  return sdo_frame(cob::kSdoResponse, node_, command, index_, sub_);
}

void SdoServer::archive(Archive& ar) {
  ar(transfer_, toggle_, index_, sub_, announced_, length_, position_, idle_ns_, buffer_);
}

}  // namespace tandem::canopen
