// A line of emulated slaves with small object dictionaries, and single datagrams to it.
// Layer: tests.  Thread: any.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/datagram.hpp"
#include "firmware_emu/slaves/slave_line.hpp"

namespace tandem::test {

using Bytes = std::vector<std::uint8_t>;

inline constexpr ethercat::MacAddress kMaster{0x00, 0x11, 0x22, 0x33, 0x44, 0x55};
inline constexpr std::int64_t kMs = 1'000'000;

/// A slave with two demands (6040, 607A) and three actual values (6041, 6064, 2000).
struct RigSlave {
  explicit RigSlave(const firmware::esc::SlaveSetup& setup) : od(300) {
    using namespace canopen;
    od.add(0x1000, 0, device_type, kRead);
    od.add_string(0x1008, 0, text);
    od.add(0x6040, 0, controlword, kWriteRpdo);
    od.add(0x607A, 0, target, kWriteRpdo);
    od.add(0x6041, 0, statusword, kReadTpdo);
    od.add(0x6064, 0, position, kReadTpdo);
    od.add(0x2000, 0, counter, kReadTpdo);
    od.add(0x2100, 0, gain, kReadWrite, {.min = -10, .max = 10});
    slave = std::make_unique<firmware::esc::Slave>(setup, od);
  }

  std::string text = std::string(200, 'x') + "end";  // longer than a mailbox
  std::uint32_t device_type = 0x00020192;
  std::uint16_t controlword = 0;
  std::int32_t target = 0;
  std::uint16_t statusword = 0x0250;
  std::int32_t position = 0;
  std::uint8_t counter = 0;
  float gain = 1.0f;
  canopen::ObjectDictionary od;
  std::unique_ptr<firmware::esc::Slave> slave;
};

[[nodiscard]] inline firmware::esc::SlaveSetup rig_setup() {
  firmware::esc::SlaveSetup setup;
  setup.identity.product = 0x11;
  setup.identity.revision = 0x22;
  setup.identity.serial = 0x33;
  setup.name = "rig";
  setup.outputs = {{.index = 0x1600, .entries = {0x60400010, 0x607A0020}}};
  setup.inputs = {{.index = 0x1A00, .entries = {0x60410010, 0x60640020, 0x20000008}}};
  return setup;
}

class LineRig {
 public:
  explicit LineRig(std::size_t count, firmware::esc::SlaveSetup setup = rig_setup())
      : LineRig(std::vector(count, setup)) {}
  explicit LineRig(const std::vector<firmware::esc::SlaveSetup>& setups) {
    std::vector<firmware::esc::Slave*> pointers;
    for (const auto& setup : setups) {
      slaves.push_back(std::make_unique<RigSlave>(setup));
      pointers.push_back(slaves.back()->slave.get());
    }
    line = std::make_unique<firmware::esc::SlaveLine>(pointers);
  }

  /// What came back of the last datagram.
  struct Answer {
    bool back = false;
    int counter = 0;
    std::uint16_t slave = 0;
    Bytes data;
  };

  /// One datagram through the line.
  Answer pass(ethercat::Command command, std::uint32_t address, const Bytes& data) {
    Bytes buffer(ethercat::kMaxFrameBytes, 0);
    ethercat::FrameWriter writer;
    writer.begin(buffer, kMaster);
    std::ranges::copy(data, writer.add(command, 1, address, data.size()).begin());
    const std::span<std::uint8_t> frame(buffer.data(), writer.finish());
    Answer answer;
    answer.back = line->pass(frame, now_ns);
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    if (!reader.next(datagram)) return answer;
    answer.counter = datagram.working_counter();
    answer.slave = datagram.slave();
    answer.data.assign(datagram.data().begin(), datagram.data().end());
    return answer;
  }
  Answer read(std::size_t position, std::uint16_t offset, std::size_t size) {
    return pass(ethercat::Command::kAprd,
                ethercat::register_address(ethercat::at_position(position), offset),
                Bytes(size, 0));
  }
  int write(std::size_t position, std::uint16_t offset, const Bytes& data) {
    return pass(ethercat::Command::kApwr,
                ethercat::register_address(ethercat::at_position(position), offset), data)
        .counter;
  }
  template <class T>
  T value(std::size_t position, std::uint16_t offset) {
    return canopen::get<T>(read(position, offset, sizeof(T)).data.data());
  }
  template <class T>
  static Bytes bytes(T number) {
    Bytes out(sizeof(T));
    canopen::put(out.data(), number);
    return out;
  }

  void step(std::int64_t dt_ns = kMs) {
    now_ns += dt_ns;
    line->process(now_ns);
  }
  /// Asks for a state and gives the slave a step. @return status and code
  std::pair<int, int> request(std::size_t position, int state) {
    write(position, ethercat::reg::kAlControl, bytes(static_cast<std::uint16_t>(state)));
    step();
    return {value<std::uint16_t>(position, ethercat::reg::kAlStatus),
            value<std::uint16_t>(position, ethercat::reg::kAlCode)};
  }
  void set_manager(std::size_t position, std::size_t number, const ethercat::SyncManager& manager) {
    Bytes out(ethercat::kSyncManagerBytes);
    ethercat::put_sync_manager(out.data(), manager);
    write(position, static_cast<std::uint16_t>(ethercat::reg::kSyncManager + 8 * number), out);
  }
  void set_mailboxes(std::size_t position) {
    set_manager(position, 0, {0x1000, 128, ethercat::kControlMailboxOut, 0, true});
    set_manager(position, 1, {0x1080, 128, ethercat::kControlMailboxIn, 0, true});
  }
  void set_process_data(std::size_t position) {
    set_manager(position, 2, {0x1800, 6, ethercat::kControlOutputs, 0, true});
    set_manager(position, 3, {0x2400, 7, ethercat::kControlInputs, 0, true});
  }
  void set_fmmu(std::size_t position, std::size_t number, const ethercat::Fmmu& fmmu) {
    Bytes out(ethercat::kFmmuBytes);
    ethercat::put_fmmu(out.data(), fmmu);
    write(position, static_cast<std::uint16_t>(ethercat::reg::kFmmu + 16 * number), out);
  }
  /// A message into the mailbox, filled up to its 128 bytes. @return the working counter
  int send_mail(std::size_t position, Bytes message) {
    message.resize(128, 0);
    return write(position, 0x1000, message);
  }
  /// Sends a message and takes the answer; empty when there is none.
  Bytes ask(std::size_t position, const Bytes& message) {
    EXPECT_EQ(send_mail(position, message), 1);
    step();
    const Answer answer = read(position, 0x1080, 128);
    if (answer.counter != 1) return {};
    const std::size_t size = 6u + canopen::get<std::uint16_t>(answer.data.data());
    return {answer.data.begin(), answer.data.begin() + static_cast<long>(size)};
  }

  std::int64_t now_ns = 0;
  std::vector<std::unique_ptr<RigSlave>> slaves;
  std::unique_ptr<firmware::esc::SlaveLine> line;
};

}  // namespace tandem::test
