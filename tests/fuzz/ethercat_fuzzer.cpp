// Whatever EtherCAT frames pass between the master and the slaves: cut, changed, lost, a
// stranger's, to either end, at the start and in OP. Neither end breaks, and both work again
// afterwards. And whatever an information memory holds.
//
// The input: the first byte is where it begins, then an act for each frame (Wire::act()).
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <span>

#include "tests/ethercat/master_rig.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem;
using fuzz::require;
using test::Bytes;

constexpr int kMostCycles = 400;  // of an input

/// Does to passing frames what the input says.
class Wire final : public ethercat::Medium {
 public:
  explicit Wire(ethercat::Medium& medium) : medium_(&medium) {}

  void follow(std::span<const std::uint8_t> input) { input_ = input; }
  [[nodiscard]] bool more() const { return !input_.empty(); }

  bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept override {
    const std::uint8_t act = more() ? byte() : 0;
    if (act == 1) return false;
    if (act == 2) change(frame);
    if (act == 3) strange(now_ns);
    const bool back = medium_->pass(frame, now_ns);
    if (act == 4) change(frame);
    if (act == 5) change_data(frame);
    if (act == 6) return false;
    return back;
  }

 private:
  std::uint8_t byte() {
    if (input_.empty()) return 0;
    const std::uint8_t value = input_.front();
    input_ = input_.subspan(1);
    return value;
  }
  /// Any byte of the frame becomes another.
  void change(std::span<std::uint8_t> frame) {
    const std::size_t at = byte() | std::size_t{byte()} << 8;
    frame[at % frame.size()] = byte();
  }
  /// The data and the working counter of a datagram become others, and the frame stays whole.
  void change_data(std::span<std::uint8_t> frame) {
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    for (std::size_t left = byte() % 8; reader.next(datagram) && left > 0; --left) {
    }
    if (reader.error() != ethercat::LineError::kNone) return;
    const std::span<std::uint8_t> data = datagram.data();
    const std::size_t from = data.empty() ? 0 : byte() % data.size();
    const std::size_t count = byte() % 32;
    for (std::size_t i = from; i < std::min(data.size(), from + count); ++i) data[i] = byte();
  }
  /// A datagram of somebody else's goes first: to any register, or into a mailbox.
  void strange(std::int64_t now_ns) {
    Bytes buffer(ethercat::kMaxFrameBytes, 0);
    ethercat::FrameWriter writer;
    writer.begin(buffer, test::kMaster);
    const auto command = static_cast<ethercat::Command>(byte() % ethercat::kCommands);
    const auto slave = static_cast<std::uint16_t>(byte() % 2 == 0 ? 0x1001 : byte());
    const auto offset = static_cast<std::uint16_t>(byte() | byte() << 8);
    const std::span<std::uint8_t> data =
        writer.add(command, 7, ethercat::register_address(slave, offset), byte());
    const std::size_t given = std::min<std::size_t>(data.size(), byte() % 64);
    for (std::size_t i = 0; i < given; ++i) data[i] = byte();
    (void)medium_->pass({buffer.data(), writer.finish()}, now_ns);
  }

  ethercat::Medium* medium_;
  std::span<const std::uint8_t> input_;
};

/// Master, slaves and the wire between them.
struct Ends {
  Ends() : line(test::MasterRig::setups(2)), wire(*line.line), link(wire) {
    auto made = hal::ecat::LineMaster::create(link, {test::rig_plan(), test::rig_plan()});
    require(made.has_value());
    master = std::move(*made);
    master->restart(0);
  }
  void cycle() {
    const hal::ecat::CycleReport& report = master->receive(line.now_ns);
    require(!report.valid || report.counter >= report.expected);
    link.set_time(line.now_ns);
    if (master->all(hal::ecat::SlaveStage::kReady)) master->start(line.now_ns);
    master->send(line.now_ns);
    line.step();
  }
  bool to_op() {
    for (int i = 0; i < 2000 && !master->all(hal::ecat::SlaveStage::kRunning); ++i) cycle();
    return master->all(hal::ecat::SlaveStage::kRunning);
  }

  test::LineRig line;
  Wire wire;
  hal::ecat::InProcessLink link;
  std::unique_ptr<hal::ecat::LineMaster> master;
};

void read_sii(std::span<const std::uint8_t> bytes) {
  ethercat::sii::Content content;
  const ethercat::LineError error = ethercat::sii::parse(bytes, content);
  require(error != ethercat::LineError::kNone ||
          content.managers.size() <= ethercat::sii::kMaxSyncManagers);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> input(data + 1, size - 1);
  if (data[0] % 4 == 0) {
    read_sii(input);
    return 0;
  }
  Ends ends;
  if (data[0] % 4 == 1) require(ends.to_op());
  // 2: from the first frame; 3: later in the start, by the rest of the byte.
  if (data[0] % 4 == 3) {
    for (int i = 0; i < 4 * (data[0] / 4); ++i) ends.cycle();
  }
  ends.wire.follow(input);
  for (int i = 0; i < kMostCycles && ends.wire.more(); ++i) {
    ends.cycle();
    (void)ends.master->resend();
  }
  (void)ends.master->text();
  // When the slaves have had their power off, nothing of it is left.
  ends.wire.follow({});
  for (std::size_t i = 0; i < 2; ++i) {
    ends.line.line->set_power(i, false, ends.line.now_ns);
    ends.line.line->set_power(i, true, ends.line.now_ns);
  }
  ends.master->restart(ends.line.now_ns);
  const bool works = ends.to_op();
  if (!works) std::fputs((ends.master->text() + "\n").c_str(), stderr);
  require(works);
  return 0;
}
