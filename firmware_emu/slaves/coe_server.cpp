// Every message is measured before it is read; what is no message gets a mailbox error.
#include "firmware_emu/slaves/coe_server.hpp"

#include <algorithm>

namespace tandem::firmware::esc {

using canopen::AbortCode;
using canopen::get;
using ethercat::CoeService;
using ethercat::kSdoAt;
using ethercat::kSdoDataAt;
using ethercat::kSegmentDataAt;
using ethercat::MailboxError;
namespace sdo_command = ethercat::sdo;

std::size_t CoeServer::answer(Bytes request, Out out) noexcept TANDEM_RT {
  ethercat::MailboxHeader header;
  if (!ethercat::read_mailbox(request, header)) return refuse(MailboxError::kSize, out);
  if (header.type != ethercat::MailboxType::kCoe) return refuse(MailboxError::kProtocol, out);
  const Bytes message = request.first(ethercat::kMailboxHeaderBytes + header.length);
  if (message.size() < kSdoAt + 1) return refuse(MailboxError::kTooShort, out);
  switch (ethercat::coe_service(message)) {
    case CoeService::kSdoRequest: return sdo(message, out);
    case CoeService::kInformation: return refuse_information(out);
    default: return refuse(MailboxError::kService, out);
  }
}

std::size_t CoeServer::sdo(Bytes message, Out out) noexcept {
  const std::uint8_t command = message[kSdoAt];
  const std::uint8_t specifier = command & sdo_command::kSpecifier;
  if (specifier == sdo_command::kDownloadSegment) return download_segment(message, out);
  if (specifier == sdo_command::kUploadSegment) return upload_segment(message, out);
  if (message.size() < kSdoDataAt) return refuse(MailboxError::kTooShort, out);
  index_ = get<std::uint16_t>(&message[kSdoAt + 1]);
  sub_ = message[kSdoAt + 3];
  transfer_ = Transfer::kNone;
  if (specifier == sdo_command::kAbort) return 0;
  if ((command & sdo_command::kComplete) != 0) return abort(AbortCode::kUnsupportedAccess, out);
  if (specifier == sdo_command::kDownloadRequest) return download(message, out);
  if (specifier == sdo_command::kUploadRequest) return upload(out);
  return abort(AbortCode::kBadCommand, out);
}

std::size_t CoeServer::download(Bytes message, Out out) noexcept {
  const std::uint8_t command = message[kSdoAt];
  AbortCode code = AbortCode::kNone;
  if ((command & sdo_command::kExpedited) != 0) {
    const std::size_t size = sdo_command::expedited_bytes(command);
    code = dictionary().write(index_, sub_, message.subspan(kSdoAt + 4, size));
  } else {
    const canopen::ObjectEntry* entry = dictionary().find(index_, sub_);
    if (entry == nullptr) return abort(dictionary().exists(index_, sub_), out);
    if ((entry->access & canopen::kWrite) == 0) return abort(AbortCode::kReadOnly, out);
    expected_ = get<std::uint32_t>(&message[kSdoAt + 4]);
    const Bytes data = message.subspan(kSdoDataAt);
    if (expected_ > buffer_.size()) return abort(AbortCode::kTooLong, out);
    length_ = std::min(data.size(), expected_);
    std::copy_n(data.begin(), length_, buffer_.begin());
    if (length_ < expected_) {
      transfer_ = Transfer::kDownload;
      toggle_ = false;
    } else {
      code = dictionary().write(index_, sub_, {buffer_.data(), length_});
    }
  }
  if (code != AbortCode::kNone) return abort(code, out);
  ethercat::write_sdo(out, sdo_command::kDownloadResponse, index_, sub_);
  return respond(out, sdo_command::kDownloadResponse, kSdoDataAt);
}

std::size_t CoeServer::download_segment(Bytes message, Out out) noexcept {
  const std::uint8_t command = message[kSdoAt];
  if (transfer_ != Transfer::kDownload) return abort(AbortCode::kBadCommand, out);
  if (((command & sdo_command::kToggle) != 0) != toggle_) return abort(AbortCode::kToggle, out);
  const Bytes room = message.subspan(kSegmentDataAt);
  const Bytes data = room.first(sdo_command::segment_bytes(command, room.size()));
  if (length_ + data.size() > expected_) return abort(AbortCode::kTooLong, out);
  std::ranges::copy(data, buffer_.begin() + static_cast<std::ptrdiff_t>(length_));
  length_ += data.size();
  if ((command & sdo_command::kLast) != 0) {
    if (length_ != expected_) return abort(AbortCode::kLength, out);
    const AbortCode code = dictionary().write(index_, sub_, {buffer_.data(), length_});
    if (code != AbortCode::kNone) return abort(code, out);
    transfer_ = Transfer::kNone;
  }
  const unsigned toggle = toggle_ ? sdo_command::kToggle : 0u;
  toggle_ = !toggle_;
  std::fill_n(out.begin() + kSegmentDataAt, ethercat::kShortSegment, std::uint8_t{0});
  return respond(out, static_cast<std::uint8_t>(sdo_command::kDownloadSegmentResponse | toggle),
                 kSegmentDataAt + ethercat::kShortSegment);
}

std::size_t CoeServer::upload(Out out) noexcept {
  const AbortCode code = dictionary().read(index_, sub_, buffer_, length_);
  if (code != AbortCode::kNone) return abort(code, out);
  if (length_ >= 1 && length_ <= sdo_command::kExpeditedBytes) {
    const auto command =
        static_cast<std::uint8_t>(sdo_command::kUploadResponse | sdo_command::expedited(length_));
    ethercat::write_sdo(out, command, index_, sub_);
    std::copy_n(buffer_.begin(), length_, out.begin() + kSdoAt + 4);
    return respond(out, command, kSdoDataAt);
  }
  const std::uint8_t command = sdo_command::kUploadResponse | sdo_command::kSizeGiven;
  ethercat::write_sdo(out, command, index_, sub_);
  canopen::put(&out[kSdoAt + 4], static_cast<std::uint32_t>(length_));
  position_ = std::min(length_, answer_bytes_ - kSdoDataAt);
  std::copy_n(buffer_.begin(), position_, out.begin() + kSdoDataAt);
  transfer_ = position_ < length_ ? Transfer::kUpload : Transfer::kNone;
  toggle_ = false;
  return respond(out, command, kSdoDataAt + position_);
}

std::size_t CoeServer::upload_segment(Bytes message, Out out) noexcept {
  if (transfer_ != Transfer::kUpload) return abort(AbortCode::kBadCommand, out);
  const bool toggle = (message[kSdoAt] & sdo_command::kToggle) != 0;
  if (toggle != toggle_) return abort(AbortCode::kToggle, out);
  const std::size_t size = std::min(length_ - position_, answer_bytes_ - kSegmentDataAt);
  const bool last = position_ + size == length_;
  std::fill_n(out.begin() + kSegmentDataAt, ethercat::kShortSegment, std::uint8_t{0});
  std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(position_), size,
              out.begin() + kSegmentDataAt);
  position_ += size;
  toggle_ = !toggle_;
  if (last) transfer_ = Transfer::kNone;
  return respond(out,
                 static_cast<std::uint8_t>(sdo_command::kUploadSegmentResponse |
                                           sdo_command::segment(size, toggle, last)),
                 kSegmentDataAt + std::max(size, ethercat::kShortSegment));
}

std::size_t CoeServer::abort(AbortCode code, Out out) noexcept {
  transfer_ = Transfer::kNone;
  ethercat::write_sdo(out, sdo_command::kAbort, index_, sub_);
  canopen::put(&out[kSdoAt + 4], static_cast<std::uint32_t>(code));
  return respond(out, sdo_command::kAbort, kSdoDataAt);
}

std::size_t CoeServer::respond(Out out, std::uint8_t command, std::size_t bytes) noexcept {
  counter_ = ethercat::next_counter(counter_);
  // An abort is a request of either end (ETG.1000.6).
  const auto service =
      command == sdo_command::kAbort ? CoeService::kSdoRequest : CoeService::kSdoResponse;
  ethercat::write_coe(out, bytes, service, counter_);
  out[kSdoAt] = command;
  return bytes;
}

std::size_t CoeServer::refuse(MailboxError error, Out out) noexcept {
  counter_ = ethercat::next_counter(counter_);
  ethercat::write_mailbox(
      out.data(), {.length = 4, .type = ethercat::MailboxType::kError, .counter = counter_});
  canopen::put(&out[ethercat::kMailboxHeaderBytes], std::uint16_t{1});
  canopen::put(&out[ethercat::kMailboxHeaderBytes + 2], static_cast<std::uint16_t>(error));
  return ethercat::kMailboxHeaderBytes + 4;
}

std::size_t CoeServer::refuse_information(Out out) noexcept {
  constexpr std::size_t kBytes = kSdoAt + 8;
  counter_ = ethercat::next_counter(counter_);
  ethercat::write_coe(out, kBytes, CoeService::kInformation, counter_);
  std::fill_n(out.begin() + kSdoAt, 8, std::uint8_t{0});
  out[kSdoAt] = 7;  // an error
  canopen::put(&out[kSdoAt + 4], static_cast<std::uint32_t>(AbortCode::kUnsupportedAccess));
  return kBytes;
}

void CoeServer::archive(Archive& ar) {
  ar(transfer_, toggle_, counter_, sub_, index_, expected_, length_, position_, buffer_);
}

}  // namespace tandem::firmware::esc
