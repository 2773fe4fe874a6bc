// Every answer is measured before it is read; see ethercat/mailbox.hpp for the bytes.
#include "hal/ethercat-can/line/coe_client.hpp"

#include <algorithm>

namespace tandem::hal::ecat {

using canopen::AbortCode;
using ethercat::CoeService;
using ethercat::kSdoAt;
using ethercat::kSdoDataAt;
using ethercat::kSegmentDataAt;
namespace reg = ethercat::reg;
namespace command = ethercat::sdo;

namespace {

constexpr std::uint16_t kInManager = reg::kSyncManager + ethercat::kSyncManagerBytes;

}  // namespace

void CoeClient::reset(std::uint16_t station,
                      const ethercat::sii::Mailbox& mailbox) noexcept TANDEM_RT {
  station_ = station;
  mailbox_ = mailbox;
  status_ = Status::kIdle;
  counter_ = 0;
  repeat_ = false;
  emergency_ = {};
}

void CoeClient::begin(std::uint16_t index, std::uint8_t sub, bool uploading) noexcept {
  status_ = Status::kBusy;
  uploading_ = uploading;
  segments_ = false;
  toggle_ = false;
  index_ = index;
  sub_ = sub;
  abort_code_ = AbortCode::kNone;
  position_ = 0;
}

void CoeClient::upload(std::uint16_t index, std::uint8_t sub) noexcept TANDEM_RT {
  begin(index, sub, true);
  length_ = 0;
  ethercat::write_sdo(message_, command::kUploadRequest, index, sub);
  post(kSdoDataAt);
}

void CoeClient::download(std::uint16_t index, std::uint8_t sub,
                         std::span<const std::uint8_t> value) noexcept TANDEM_RT {
  begin(index, sub, false);
  length_ = std::min(value.size(), buffer_.size());
  std::copy_n(value.begin(), length_, buffer_.begin());
  send_download();
}

void CoeClient::send_download() noexcept {
  if (length_ <= command::kExpeditedBytes) {
    const auto first =
        static_cast<std::uint8_t>(command::kDownloadRequest | command::expedited(length_));
    ethercat::write_sdo(message_, first, index_, sub_);
    std::copy_n(buffer_.begin(), length_, message_.begin() + kSdoAt + 4);
    position_ = length_;
    return post(kSdoDataAt);
  }
  ethercat::write_sdo(message_, command::kDownloadRequest | command::kSizeGiven, index_, sub_);
  canopen::put(&message_[kSdoAt + 4], static_cast<std::uint32_t>(length_));
  position_ = std::min<std::size_t>(length_, mailbox_.out_bytes - kSdoDataAt);
  std::copy_n(buffer_.begin(), position_, message_.begin() + kSdoDataAt);
  post(kSdoDataAt + position_);
}

void CoeClient::send_segment() noexcept {
  const std::size_t size =
      std::min<std::size_t>(length_ - position_, mailbox_.out_bytes - kSegmentDataAt);
  const bool last = position_ + size == length_;
  std::fill_n(message_.begin() + kSegmentDataAt, ethercat::kShortSegment, std::uint8_t{0});
  std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(position_), size,
              message_.begin() + kSegmentDataAt);
  message_[kSdoAt] =
      static_cast<std::uint8_t>(command::kDownloadSegment | command::segment(size, toggle_, last));
  position_ += size;
  post(kSegmentDataAt + std::max(size, ethercat::kShortSegment));
}

void CoeClient::ask_segment() noexcept {
  std::fill_n(message_.begin() + kSegmentDataAt, ethercat::kShortSegment, std::uint8_t{0});
  message_[kSdoAt] =
      static_cast<std::uint8_t>(command::kUploadSegment | (toggle_ ? command::kToggle : 0u));
  post(kSegmentDataAt + ethercat::kShortSegment);
}

void CoeClient::post(std::size_t bytes) noexcept {
  counter_ = ethercat::next_counter(counter_);
  ethercat::write_coe(message_, bytes, CoeService::kSdoRequest, counter_);
  std::fill(message_.begin() + static_cast<std::ptrdiff_t>(bytes), message_.end(), std::uint8_t{0});
  step_ = Step::kWrite;
  since_ns_ = -1;
}

void CoeClient::process(std::int64_t now_ns, Exchange& exchange,
                        std::size_t channel) noexcept TANDEM_RT {
  if (status_ != Status::kBusy) return;
  const DatagramRequest& request = exchange.at(channel);
  if (request.state == DatagramRequest::State::kDone) {
    answered(request);
    exchange.release(channel);
  } else if (request.state == DatagramRequest::State::kLost) {
    exchange.release(channel);
    lost();
  }
  if (status_ != Status::kBusy || !exchange.idle(channel)) return;
  if (since_ns_ < 0) since_ns_ = now_ns;
  if (now_ns - since_ns_ >= kAnswerNs) return abort(AbortCode::kTimeout);
  ask(exchange, channel);
}

void CoeClient::ask(Exchange& exchange, std::size_t channel) noexcept {
  switch (step_) {
    case Step::kWrite:
      return exchange.write_at(channel, station_, mailbox_.out_start,
                               {message_.data(), mailbox_.out_bytes});
    case Step::kLook:
    case Step::kWaitAgain:
      return exchange.read_at(channel, station_, kInManager, ethercat::kSyncManagerBytes);
    case Step::kRead:  // once only: a mailbox that has been read is empty
      return exchange.read_at(channel, station_, mailbox_.in_start, mailbox_.in_bytes, 1);
    case Step::kAskAgain: {
      const std::array<std::uint8_t, 1> control{static_cast<std::uint8_t>(
          ethercat::kSmEnable | (repeat_ ? 0u : unsigned{ethercat::kSmRepeat}))};
      return exchange.write_at(channel, station_, kInManager + 6, control);
    }
  }
}

void CoeClient::answered(const DatagramRequest& request) noexcept {
  if (request.counter != 1) {
    // The mailbox is still full, or was found empty; or the slave is gone, and time tells.
    if (step_ == Step::kRead) step_ = Step::kAskAgain;
    return;
  }
  switch (step_) {
    case Step::kWrite: step_ = Step::kLook; return;
    case Step::kLook:
      if ((request.data[5] & ethercat::kMailboxFull) != 0) step_ = Step::kRead;
      return;
    case Step::kRead: step_ = Step::kLook; return take({request.data.data(), mailbox_.in_bytes});
    case Step::kAskAgain:
      repeat_ = !repeat_;
      step_ = Step::kWaitAgain;
      return;
    case Step::kWaitAgain:
      if (((request.data[7] & ethercat::kSmRepeat) != 0) == repeat_) step_ = Step::kLook;
      return;
  }
}

void CoeClient::lost() noexcept {
  if (step_ == Step::kRead) step_ = Step::kAskAgain;
}

void CoeClient::take(Bytes message) noexcept {
  ethercat::MailboxHeader header;
  if (!ethercat::read_mailbox(message, header)) return;
  message = message.first(ethercat::kMailboxHeaderBytes + header.length);
  if (header.type == ethercat::MailboxType::kError && header.length >= 4) {
    return abort(AbortCode::kGeneral);
  }
  if (header.type != ethercat::MailboxType::kCoe || message.size() <= kSdoAt) return;
  const CoeService service = ethercat::coe_service(message);
  if (service == CoeService::kEmergency && message.size() >= kSdoAt + 2) {
    emergency_ = {};
    std::copy_n(message.begin() + kSdoAt, std::min(emergency_.size(), message.size() - kSdoAt),
                emergency_.begin());
    ++emergencies_;
    return;
  }
  const bool aborts = (message[kSdoAt] & command::kSpecifier) == command::kAbort;
  if (service == CoeService::kSdoResponse || (service == CoeService::kSdoRequest && aborts)) {
    take_response(message);
  }
}

void CoeClient::take_response(Bytes message) noexcept {
  const unsigned specifier = message[kSdoAt] & command::kSpecifier;
  if (specifier == command::kAbort) {
    if (message.size() < kSdoDataAt) return;
    if (canopen::get<std::uint16_t>(&message[kSdoAt + 1]) != index_) return;  // a late one
    return abort(static_cast<AbortCode>(canopen::get<std::uint32_t>(&message[kSdoAt + 4])));
  }
  if (segments_ && uploading_) return take_segment(message);
  if (segments_) {
    if (specifier != command::kDownloadSegmentResponse) return;
    if (((message[kSdoAt] & command::kToggle) != 0) != toggle_) return abort(AbortCode::kToggle);
    toggle_ = !toggle_;
    if (position_ < length_) return send_segment();
    status_ = Status::kDone;
    return;
  }
  if (message.size() < kSdoDataAt) return;
  const bool ours =
      canopen::get<std::uint16_t>(&message[kSdoAt + 1]) == index_ && message[kSdoAt + 3] == sub_;
  if (!ours) return;
  if (uploading_ && specifier == command::kUploadResponse) return take_upload(message);
  if (uploading_ || specifier != command::kDownloadResponse) return;
  segments_ = position_ < length_;
  if (segments_) return send_segment();
  status_ = Status::kDone;
}

void CoeClient::take_upload(Bytes message) noexcept {
  if ((message[kSdoAt] & command::kExpedited) != 0) {
    length_ = command::expedited_bytes(message[kSdoAt]);
    std::copy_n(message.begin() + kSdoAt + 4, length_, buffer_.begin());
    status_ = Status::kDone;
    return;
  }
  expected_ = canopen::get<std::uint32_t>(&message[kSdoAt + 4]);
  if (expected_ > buffer_.size()) return abort(AbortCode::kTooLong);
  length_ = std::min(message.size() - kSdoDataAt, expected_);
  std::copy_n(message.begin() + kSdoDataAt, length_, buffer_.begin());
  segments_ = length_ < expected_;
  if (segments_) return ask_segment();
  status_ = Status::kDone;
}

void CoeClient::take_segment(Bytes message) noexcept {
  if ((message[kSdoAt] & command::kSpecifier) != command::kUploadSegmentResponse) return;
  if (((message[kSdoAt] & command::kToggle) != 0) != toggle_) return abort(AbortCode::kToggle);
  const Bytes room = message.subspan(kSegmentDataAt);
  const std::size_t size = command::segment_bytes(message[kSdoAt], room.size());
  if (length_ + size > expected_) return abort(AbortCode::kTooLong);
  std::copy_n(room.begin(), size, buffer_.begin() + static_cast<std::ptrdiff_t>(length_));
  length_ += size;
  toggle_ = !toggle_;
  if ((message[kSdoAt] & command::kLast) == 0) return ask_segment();
  if (length_ != expected_) return abort(AbortCode::kLength);
  status_ = Status::kDone;
}

void CoeClient::abort(AbortCode code) noexcept {
  abort_code_ = code;
  status_ = Status::kAborted;
}

}  // namespace tandem::hal::ecat
