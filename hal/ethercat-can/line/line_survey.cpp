// Every question goes to all slaves at once, by their position: no address has to be written.
#include "hal/ethercat-can/line/line_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canopen/bytes.hpp"
#include "ethercat/registers.hpp"
#include "hal/ethercat-can/line/clock_times.hpp"
#include "hal/ethercat-can/line/exchange.hpp"
#include "hal/ethercat-can/line/slave_master.hpp"

namespace tandem::hal::ecat {
namespace {

using canopen::get;
using canopen::put;
using ethercat::at_position;
using ethercat::Command;
using ethercat::register_address;
using Data = std::span<const std::uint8_t>;
namespace reg = ethercat::reg;
namespace sii = ethercat::sii;

constexpr std::size_t kMostFrames = 32;
constexpr std::int64_t kAnswerNs = 1'000'000;
constexpr std::uint16_t kSpeedStartWord = 0x1000;
constexpr int kSiiTries = 100;  ///< questions whether the memory has been read

class Surveyor {
 public:
  Surveyor(DataLink& link, const SurveyWait& wait)
      : link_(&link), wait_(&wait), exchange_(kMostSurveyed), batch_(kMostFrames), came_(8) {}

  void listen(std::int64_t time_ns);
  void count();
  void identify();
  void find_clocks();
  void set_clocks();
  void measure(const SurveyTiming& timing);
  LineSurvey take() {
    survey_.repeated = exchange_.repeated();
    return std::move(survey_);
  }
  [[nodiscard]] const LineSurvey& survey() const { return survey_; }

 private:
  void take_frames();
  /// Sends what is wanted until all of it has come or is lost, and at least until `until_ns`.
  void carry(std::int64_t until_ns = 0);
  void read(std::size_t slave, std::uint16_t offset, std::size_t size);
  void write(std::size_t slave, std::uint16_t offset, Data data);
  /// The answer of `slave`; empty when it gave none. Frees its channel.
  std::vector<std::uint8_t> answer(std::size_t slave);
  /// Reads `size` bytes of a register of every slave.
  std::vector<std::vector<std::uint8_t>> read_all(std::uint16_t offset, std::size_t size);
  void write_all(std::uint16_t offset, Data data);
  /// Eight bytes of every slave's SII; of those that give only four, these. Empty: not readable.
  std::vector<std::vector<std::uint8_t>> read_sii(std::uint32_t word);
  /// The reference's time to all, and each one's difference. @return by slave; 0 when not known
  std::vector<std::pair<bool, std::int32_t>> cycle(std::int64_t period_ns);

  [[nodiscard]] std::size_t size() const { return survey_.slaves.size(); }

  DataLink* link_;
  const SurveyWait* wait_;
  Exchange exchange_;
  FrameBatch batch_;
  std::vector<FrameBuffer> came_;
  LineSurvey survey_;
  bool cyclic_ = false;  ///< the next frames begin with the reference's time
  std::int64_t now_ns_ = 0;
};

void Surveyor::take_frames() {
  for (std::size_t count = came_.size(); count == came_.size();) {
    count = link_->receive(came_);
    for (std::size_t i = 0; i < count; ++i) {
      const std::span<std::uint8_t> frame = came_[i].frame();
      if (ethercat::check_frame(frame) != ethercat::LineError::kNone) continue;
      ethercat::MacAddress source{};
      std::copy_n(frame.begin() + 6, source.size(), source.begin());
      source[0] &= static_cast<std::uint8_t>(~ethercat::kProcessedMark);
      if (source != link_->address()) {
        ++survey_.strangers;
        continue;
      }
      ethercat::FrameReader reader(frame);
      ethercat::Datagram datagram;
      while (reader.next(datagram)) exchange_.take(datagram);
    }
  }
}

void Surveyor::listen(std::int64_t time_ns) {
  now_ns_ = (*wait_)(0);
  const std::int64_t until_ns = now_ns_ + time_ns;
  const std::uint64_t before = link_->statistics().received;
  while (now_ns_ < until_ns) {
    now_ns_ = (*wait_)(std::min(until_ns - now_ns_, kAnswerNs));
    take_frames();
  }
  // Nothing was sent, so whatever came is another's: also a program that uses this interface.
  survey_.strangers = link_->statistics().received - before;
}

void Surveyor::carry(std::int64_t until_ns) {
  const auto wanted = [this] {
    for (std::size_t i = 0; i < kMostSurveyed; ++i) {
      const DatagramRequest::State state = exchange_.at(i).state;
      if (state == DatagramRequest::State::kWanted || state == DatagramRequest::State::kSent)
        return true;
    }
    return false;
  };
  while (survey_.strangers == 0 && (now_ns_ < until_ns || wanted())) {
    batch_.begin(link_->address());
    if (std::exchange(cyclic_, false)) {
      (void)batch_.add(Command::kArmw, Exchange::kIndices,
                       register_address(at_position(survey_.reference), reg::kSystemTime), 8);
    }
    exchange_.collect(batch_, now_ns_);
    (void)link_->send(batch_.finish());
    const bool pause = !wanted();
    now_ns_ = (*wait_)(pause ? until_ns - now_ns_ : kAnswerNs);
    take_frames();
    exchange_.age(now_ns_);
  }
}

void Surveyor::read(std::size_t slave, std::uint16_t offset, std::size_t size) {
  ++survey_.asked;
  exchange_.read(slave, Command::kAprd, register_address(at_position(slave), offset), size);
}

void Surveyor::write(std::size_t slave, std::uint16_t offset, Data data) {
  ++survey_.asked;
  exchange_.write(slave, Command::kApwr, register_address(at_position(slave), offset), data);
}

std::vector<std::uint8_t> Surveyor::answer(std::size_t slave) {
  const DatagramRequest& request = exchange_.at(slave);
  std::vector<std::uint8_t> bytes;
  if (request.state == DatagramRequest::State::kDone && request.counter == 1) {
    bytes.assign(request.bytes().begin(), request.bytes().end());
  }
  exchange_.release(slave);
  return bytes;
}

std::vector<std::vector<std::uint8_t>> Surveyor::read_all(std::uint16_t offset, std::size_t bytes) {
  for (std::size_t i = 0; i < size(); ++i) read(i, offset, bytes);
  carry();
  std::vector<std::vector<std::uint8_t>> all(size());
  for (std::size_t i = 0; i < size(); ++i) all[i] = answer(i);
  return all;
}

void Surveyor::write_all(std::uint16_t offset, Data data) {
  ++survey_.asked;
  exchange_.write(0, Command::kBwr, register_address(0, offset), data);
  carry();
  exchange_.release(0);
}

void Surveyor::count() {
  ++survey_.asked;
  exchange_.read(0, Command::kBrd, register_address(0, reg::kAlStatus), 2);
  carry();
  const DatagramRequest& request = exchange_.at(0);
  if (request.state == DatagramRequest::State::kDone) {
    survey_.found = request.counter;
    survey_.states = request.bytes()[0];
  }
  exchange_.release(0);
  survey_.slaves.resize(std::min(survey_.found, kMostSurveyed));
  survey_.reference = size();
}

std::vector<std::vector<std::uint8_t>> Surveyor::read_sii(std::uint32_t word) {
  std::array<std::uint8_t, 6> command{};
  put(&command[0], std::uint16_t{ethercat::kSiiRead});
  put(&command[2], word);
  for (std::size_t i = 0; i < size(); ++i) write(i, reg::kSiiControl, command);
  carry();
  for (std::size_t i = 0; i < size(); ++i) exchange_.release(i);
  std::vector<std::vector<std::uint8_t>> all(size());
  std::vector<bool> over(size(), false);
  for (int tries = 0; tries < kSiiTries && std::ranges::count(over, false) > 0; ++tries) {
    for (std::size_t i = 0; i < size(); ++i) {
      if (!over[i]) read(i, reg::kSiiControl, 14);
    }
    carry(now_ns_ + kAnswerNs);
    for (std::size_t i = 0; i < size(); ++i) {
      if (over[i]) continue;
      const auto bytes = answer(i);
      const unsigned control = bytes.empty() ? 0u : get<std::uint16_t>(bytes.data());
      if ((control & ethercat::kSiiBusy) != 0) continue;
      over[i] = true;
      if (bytes.empty() || (control & ethercat::kSiiRefused) != 0) continue;
      const std::ptrdiff_t size = (control & ethercat::kSiiReads8Bytes) != 0 ? 8 : 4;
      all[i].assign(bytes.begin() + 6, bytes.begin() + 6 + size);
    }
  }
  return all;
}

void Surveyor::identify() {
  write_all(reg::kSiiConfig, std::array<std::uint8_t, 1>{});  // the memory is the master's
  const auto vendors = read_sii(sii::kVendorWord);
  const auto products = read_sii(sii::kVendorWord + 2);
  const auto revisions = read_sii(sii::kVendorWord + 4);
  std::vector<std::vector<std::uint8_t>> settings(size());
  for (std::uint32_t word = 0; word < sii::kVendorWord; word += 2) {
    const auto parts = read_sii(word);
    for (std::size_t i = 0; i < size(); ++i) {
      if (parts[i].empty()) continue;
      settings[i].insert(settings[i].end(), parts[i].begin(), parts[i].begin() + 4);
    }
  }
  for (std::size_t i = 0; i < size(); ++i) {
    SurveyedSlave& slave = survey_.slaves[i];
    slave.identified = !vendors[i].empty() && !products[i].empty() && !revisions[i].empty();
    const bool whole = settings[i].size() == 2 * sii::kVendorWord;
    slave.settings_right = !whole || settings[i][14] == sii::check_sum(settings[i]);
    if (!slave.identified) continue;
    slave.identity = {.vendor = get<std::uint32_t>(vendors[i].data()),
                      .product = get<std::uint32_t>(products[i].data()),
                      .revision = get<std::uint32_t>(revisions[i].data())};
  }
}

void Surveyor::find_clocks() {
  const auto features = read_all(reg::kFeatures, 2);
  for (std::size_t i = 0; i < size(); ++i) {
    survey_.slaves[i].has_clock = !features[i].empty() && (get<std::uint16_t>(features[i].data()) &
                                                           ethercat::kFeatureDc) != 0;
  }
  const auto first = std::ranges::find_if(survey_.slaves, &SurveyedSlave::has_clock);
  survey_.reference = static_cast<std::size_t>(first - survey_.slaves.begin());
}

void Surveyor::set_clocks() {
  constexpr std::size_t kLatched = 0x20;
  const auto ports = read_all(reg::kDlStatus, 2);
  write_all(reg::kReceiveTime, std::array<std::uint8_t, 4>{});
  const auto stamps = read_all(reg::kReceiveTime, kLatched);
  std::vector<Latched> latched(size());
  for (std::size_t i = 0; i < size(); ++i) {
    if (ports[i].empty() || stamps[i].empty()) continue;
    latched[i] = {.arrived = get<std::uint32_t>(&stamps[i][0]),
                  .returned = get<std::uint32_t>(&stamps[i][4]),
                  .behind = (get<std::uint16_t>(ports[i].data()) & ethercat::open_bit(1)) != 0,
                  .local_ns = get<std::uint64_t>(&stamps[i][0x18])};
  }
  const Latched& reference = latched[survey_.reference];
  const std::uint64_t offset = static_cast<std::uint64_t>(now_ns_) - reference.local_ns;
  for (std::size_t i = 0; i < size(); ++i) {
    SurveyedSlave& slave = survey_.slaves[i];
    if (!slave.has_clock) continue;
    slave.delay_ns = delay_ns(reference, latched[i]);
    std::array<std::uint8_t, 12> times{};
    put(&times[0], offset_ns(reference, offset, latched[i]));
    put(&times[8], slave.delay_ns);
    write(i, reg::kTimeOffset, times);
  }
  carry();
  for (std::size_t i = 0; i < size(); ++i) exchange_.release(i);
  std::array<std::uint8_t, 2> speed{};
  put(speed.data(), kSpeedStartWord);
  write_all(reg::kSpeedStart, speed);
}

std::vector<std::pair<bool, std::int32_t>> Surveyor::cycle(std::int64_t period_ns) {
  const auto follows = [this](std::size_t i) {
    return i != survey_.reference && survey_.slaves[i].has_clock;
  };
  for (std::size_t i = 0; i < size(); ++i) {
    if (follows(i)) read(i, reg::kTimeDifference, 4);
  }
  cyclic_ = true;
  carry(now_ns_ + period_ns);
  std::vector<std::pair<bool, std::int32_t>> all(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const auto bytes = follows(i) ? answer(i) : std::vector<std::uint8_t>{};
    if (bytes.empty()) continue;
    const auto raw = get<std::uint32_t>(bytes.data());
    const auto off = static_cast<std::int32_t>(raw & ~ethercat::kDifferenceSign);
    all[i] = {true, (raw & ethercat::kDifferenceSign) != 0 ? -off : off};
  }
  return all;
}

void Surveyor::measure(const SurveyTiming& timing) {
  const auto near = [](const auto& one) {
    return std::abs(std::int64_t{one.second}) <= SlaveClock::kSettledNs;
  };
  constexpr int kNearCycles = 20;  // the difference may pass through 0 on its way
  const std::int64_t until_ns = now_ns_ + timing.settle_ns;
  for (int calm = 0; calm < kNearCycles && now_ns_ < until_ns && survey_.strangers == 0;) {
    calm = std::ranges::all_of(cycle(timing.period_ns), near) ? calm + 1 : 0;
  }
  std::vector<double> sum(size());
  std::vector<double> squares(size());
  for (int i = 0; i < timing.cycles && survey_.strangers == 0; ++i) {
    const auto differences = cycle(timing.period_ns);
    for (std::size_t s = 0; s < size(); ++s) {
      const auto [known, off] = differences[s];
      if (!known) continue;
      SurveyedSlave& slave = survey_.slaves[s];
      ++slave.samples;
      slave.difference_ns = std::max(slave.difference_ns, std::abs(std::int64_t{off}));
      sum[s] += off;
      squares[s] += static_cast<double>(off) * off;
    }
  }
  for (std::size_t s = 0; s < size(); ++s) {
    SurveyedSlave& slave = survey_.slaves[s];
    if (slave.samples == 0) continue;
    const auto n = static_cast<double>(slave.samples);
    slave.jitter_ns = std::sqrt(std::max(0.0, squares[s] / n - sum[s] / n * (sum[s] / n)));
  }
}

}  // namespace

LineSurvey survey_line(DataLink& link, const SurveyTiming& timing, const SurveyWait& wait) {
  Surveyor surveyor(link, wait);
  const LineSurvey& survey = surveyor.survey();
  const auto alone = [&survey] { return survey.strangers == 0; };
  surveyor.listen(timing.listen_ns);
  if (alone()) surveyor.count();
  if (!alone() || survey.slaves.empty()) return surveyor.take();
  surveyor.identify();
  if (alone()) surveyor.find_clocks();
  const bool clocks = survey.reference < survey.slaves.size();
  const bool at_rest = survey.states == std::to_underlying(ethercat::AlState::kInit);
  if (!alone() || !clocks || !at_rest) return surveyor.take();
  surveyor.set_clocks();
  surveyor.measure(timing);
  return surveyor.take();
}

}  // namespace tandem::hal::ecat
