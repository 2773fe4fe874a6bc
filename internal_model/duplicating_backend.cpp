#include "internal_model/duplicating_backend.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

#include "base/archive.hpp"

namespace tandem::internal_model {

DuplicatingBackend::DuplicatingBackend(hal::Backend& first, CommandTape& tape, std::size_t joints,
                                       const std::atomic<std::uint64_t>& done,
                                       const hal::TruthImage* truth)
    : ForwardingBackend(first), tape_(&tape), done_(&done), truth_(truth), revisions_(joints) {}

void DuplicatingBackend::exchange(const hal::CycleTime& time) noexcept {
  if (to().pace() == hal::Pace::kSimulatedClock) wait_for_second(kMostBehind - 1);
  to().exchange(time);
}

void DuplicatingBackend::wait_for_second(std::uint64_t most_behind) const noexcept {
  while (cycles_ - done_->load(std::memory_order_acquire) > most_behind) {
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
}

/// Records count on, whatever the time: they are the tape's.
bool DuplicatingBackend::archive(Archive& ar) {
  if (!second_ || !to().archive(ar)) return false;
  wait_for_second(0);
  ar(late_calls_, late_);
  late_calls_ = std::min(late_calls_, late_.size());  // bytes of something else
  if (ar.reading()) gains_known_ = false;
  return second_(ar);
}

Code DuplicatingBackend::read(const hal::CycleTime& time,
                              hal::StateImage& state) noexcept TANDEM_RT {
  const Code code = to().read(time, state);
  record_ = tape_->begin_push();
  ++cycles_;
  if (record_ == nullptr) return code;
  CommandRecord& record = *record_;
  record.number = cycles_;
  record.time = time;
  record.phase = to().phase();
  record.again = outside_ != nullptr && outside_->closed;
  record.written = record.shut_down = record.new_gains = false;
  record.calls_made = record.calls_before = late_calls_;
  std::copy_n(late_.begin(), late_calls_, record.calls.begin());
  record.state.assign(state);
  if (truth_ != nullptr) {
    std::ranges::copy(truth_->base_position_m(), record.base.begin());
    std::ranges::copy(truth_->base_quaternion(), record.base.begin() + 3);
  }
  late_calls_ = 0;
  return code;
}

void DuplicatingBackend::stop(hal::StopCategory category) noexcept TANDEM_RT {
  to().stop(category);
  note({.what = BackendCall::What::kStop, .category = category});
}

void DuplicatingBackend::reset() noexcept TANDEM_RT {
  to().reset();
  note({.what = BackendCall::What::kReset});
}

bool DuplicatingBackend::home(std::size_t joint) noexcept TANDEM_RT {
  const bool begins = to().home(joint);
  if (begins) {
    note({.what = BackendCall::What::kHome, .joint = static_cast<std::uint16_t>(joint)});
  }
  return begins;
}

void DuplicatingBackend::stop_homing(std::size_t joint) noexcept TANDEM_RT {
  to().stop_homing(joint);
  note({.what = BackendCall::What::kStopHoming, .joint = static_cast<std::uint16_t>(joint)});
}

/// What is called after write() belongs to the next record.
void DuplicatingBackend::note(const BackendCall& call) noexcept TANDEM_RT {
  if (record_ != nullptr) return record_->add(call);
  if (late_calls_ < late_.size()) late_[late_calls_++] = call;
}

Code DuplicatingBackend::write(const hal::CommandImage& command,
                               const hal::ParameterImage& gains) noexcept TANDEM_RT {
  if (record_ != nullptr) {
    record_->written = true;
    record_->command.assign(command);
    for (std::size_t j = 0; j < revisions_.size(); ++j) {
      record_->new_gains = record_->new_gains || revisions_[j] != gains.revision(j);
      revisions_[j] = gains.revision(j);
    }
    record_->new_gains = record_->new_gains || !gains_known_;
    if (record_->new_gains) record_->gains = gains;  // equally large: its memory stays
    gains_known_ = true;
  }
  end_record();
  return to().write(command, gains);
}

bool DuplicatingBackend::shut_down() noexcept TANDEM_RT {
  if (record_ != nullptr) record_->shut_down = true;
  end_record();
  return to().shut_down();
}

/// The cycle's last call: the second robot may go on.
void DuplicatingBackend::end_record() noexcept TANDEM_RT {
  if (record_ != nullptr) tape_->end_push();
  record_ = nullptr;
}

}  // namespace tandem::internal_model
