// The state of the line's master, between two cycles.
#include <algorithm>

#include "base/archive.hpp"
#include "hal/ethercat-can/line/line_master.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"

namespace tandem::hal::ecat {

void Exchange::archive(Archive& ar) {
  for (DatagramRequest& r : requests_) {
    ar(r.state, r.command, r.index, r.tries_left, r.length, r.counter, r.address, r.sent_ns,
       r.waited, r.data);
  }
  ar(next_index_, first_, repeated_);
}

void CoeClient::archive(Archive& ar) {
  ar(station_, mailbox_.out_start, mailbox_.out_bytes, mailbox_.in_start, mailbox_.in_bytes,
     status_, step_, uploading_, segments_, toggle_, repeat_, counter_, sub_, index_, emergency_,
     emergencies_, abort_code_, expected_, length_, position_, since_ns_, buffer_, message_);
}

void ProcessImage::archive(Archive& ar) {
  for (Group& group : groups_) ar(group.counter, group.expected, group.back);
  ar(out_, in_, index_);
}

void SlaveClock::archive(Archive& ar) {
  ar(present_, is_reference_, behind_, delay_ns_, offset_ns_, sync0_start_ns_, difference_ns_,
     reference_times_.arrived, reference_times_.returned, reference_times_.behind,
     reference_times_.local_ns);
}

void SlaveMaster::archive(Archive& ar) {
  ar(stage_, error_, part_, misses_, since_ns_, trouble_ns_, state_written_, look_wanted_,
     difference_wanted_, started_step_, goes_on_, wanted_, al_state_, al_code_, step_, category_at_,
     outputs_memory_, inputs_memory_, clock_, coe_);
  std::size_t size = sii_.size();
  ar(size);
  if (ar.reading()) sii_.resize(std::min(size, sii_.capacity()));
  for (std::uint8_t& byte : sii_) ar(byte);
  if (ar.reading() && !sii_.empty()) (void)ethercat::sii::parse(sii_, content_);
}

void LineMaster::archive(Archive& ar) {
  ar(image_, slaves_, exchange_, scan_, part_, scan_ns_, error_, broken_cable_, found_,
     short_reach_, full_reach_, mended_, index_, sent_, stopped_, scan_is_slow_, writes_,
     watch_back_, states_, latching_, turn_);
  ar(cycle_.complete, cycle_.valid, cycle_.counter, cycle_.expected, cycle_.reached,
     cycle_.lost_in_row, cycle_.short_in_row, cycle_.reference_ns);
  ar(statistics_, reference_.station, reference_.set, reference_.offset_ns, reference_.time_ns);
}

void LoopbackLink::Queue::archive(Archive& ar) {
  std::size_t waiting = count;
  ar(waiting);
  if (ar.reading()) {
    first = 0;
    count = std::min(waiting, kWaiting);
  }
  for (std::size_t i = 0; i < count; ++i) {
    FrameBuffer& frame = frames[(first + i) % kWaiting];
    ar(frame.size);
    frame.size = std::min(frame.size, frame.bytes.size());
    ar.raw(frame.bytes.data(), frame.size);
  }
}

void LoopbackLink::archive(Archive& ar) { ar(to_slaves_, to_master_); }

}  // namespace tandem::hal::ecat
