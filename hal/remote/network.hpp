// A network that delays, loses, doubles and reorders messages, in this process: the parameters and
// the meaning of Linux' netem, seeded, in the time of its caller.
// Layer: hal/remote.  Thread: one at a time; made non-RT, the rest RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"

namespace tandem::remote {

/// Distribution of the delay about its mean (iproute2's netem/*.c).
enum class DelayDistribution : std::uint8_t {
  kUniform,       ///< mean +- jitter
  kNormal,        ///< standard deviation: jitter
  kPareto,        ///< 4/3 jitter (X - 1.5), X of Pareto with exponent 3 from 1; 4 jitters at most
  kParetoNormal,  ///< a quarter of the normal one and three of the Pareto one, at one quantile
};

enum class LossModel : std::uint8_t {
  kRandom,          ///< each message by `loss`, with correlation
  kMarkov,          ///< four states: p13, p31, p32, p23, p14
  kGilbertElliott,  ///< two states: p, r, 1-h, 1-k
};

/// Probabilities are shares of 1. One direction of a link.
struct NetworkConfig {
  double delay_s = 0.0;
  double jitter_s = 0.0;
  double delay_correlation = 0.0;  ///< of the random number with the one before
  DelayDistribution distribution = DelayDistribution::kUniform;

  LossModel loss_model = LossModel::kRandom;
  double loss = 0.0;
  double loss_correlation = 0.0;
  /// From state i to j; 1: received in a gap, 2: received in a burst, 3: lost in a burst, 4: lost
  /// alone. Lost are those that find states 3 and 4.
  double p13 = 0.0, p31 = 1.0, p32 = 0.0, p23 = 1.0, p14 = 0.0;
  double to_bad = 0.0;        ///< p: from the good state to the bad one, a message
  double to_good = 1.0;       ///< r: back
  double loss_in_bad = 1.0;   ///< 1-h
  double loss_in_good = 0.0;  ///< 1-k

  double duplicate = 0.0;
  double duplicate_correlation = 0.0;
  double reorder = 0.0;  ///< share of messages that are not delayed at all
  double reorder_correlation = 0.0;
  std::uint32_t gap = 1;     ///< only every gap-th message may be one of them
  double rate_bit_s = 0.0;   ///< 0: no limit
  std::size_t limit = 1000;  ///< messages under way; more are dropped
  /// Jitter alone lets a message overtake one before. true: none does, as with netem's `rate`.
  bool keeps_order = false;

  bool operator==(const NetworkConfig&) const = default;
};

/// What is wrong with a configuration, by key ("loss"); none: nothing.
[[nodiscard]] Status check(const NetworkConfig& config);

/// The share of messages that is lost in the long run. With loss_correlation fewer are, as netem
/// loses fewer: its correlated numbers are seldom near 0.
[[nodiscard]] double mean_loss(const NetworkConfig& config);

/// The command that does the same to a real interface:
/// "tc qdisc add dev eth0 root netem limit 1000 delay 250ms 20ms ...".
[[nodiscard]] std::string tc_command(const NetworkConfig& config, const std::string& interface);

/// netem's correlated random numbers, in [0, 1): x = (1 - rho) u + rho x'.
class CorrelatedRandom {
 public:
  CorrelatedRandom(double correlation, std::uint64_t seed) noexcept;
  [[nodiscard]] double next() noexcept TANDEM_RT;
  void archive(Archive& ar) { ar(state_, last_); }

 private:
  double correlation_;
  std::uint64_t state_;
  double last_;
};

/// Messages under way. A function of configuration, seed and calls, to the last bit.
class Network {
 public:
  struct Counts {
    std::uint64_t sent = 0, lost = 0, dropped = 0, duplicated = 0, reordered = 0, delivered = 0;
  };

  /// @param most_bytes  of a message.  @pre check(config)
  Network(const NetworkConfig& config, std::uint64_t seed, std::size_t most_bytes);

  /// Sends a message at `now_ns`, which does not go back. @return false: nothing of it will arrive
  /// @rt no allocation; O(log limit)
  bool send(std::int64_t now_ns, std::span<const std::byte> message) noexcept TANDEM_RT;
  /// The message that arrived first of those that have by `now_ns`; empty: none has. Good until the
  /// next call.
  [[nodiscard]] std::span<const std::byte> receive(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Nothing that is sent arrives from now on, or again; what is under way does.
  void cut(bool is_cut) noexcept TANDEM_RT { cut_ = is_cut; }
  /// What is sent from now on has another delay, jitter and share of loss, at random. NaN: as it
  /// is. @pre they are what check() allows
  void change(double delay_s, double jitter_s, double loss) noexcept TANDEM_RT;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::size_t under_way() const noexcept { return queue_.size() - free_; }
  void archive(Archive& ar);

 private:
  struct Slot {  // in the heap
    std::int64_t arrival_ns = 0;
    std::uint64_t number = 0;  // of the order of sending; breaks ties
    std::uint32_t place = 0;   // of its bytes
    std::uint32_t bytes = 0;
  };
  static bool later(const Slot& a, const Slot& b) noexcept {
    return a.arrival_ns != b.arrival_ns ? a.arrival_ns > b.arrival_ns : a.number > b.number;
  }
  [[nodiscard]] bool is_lost() noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t delay_ns() noexcept TANDEM_RT;
  bool put(std::int64_t now_ns, std::span<const std::byte> message) noexcept TANDEM_RT;

  NetworkConfig config_;
  CorrelatedRandom delay_, loss_, duplicate_, reorder_;
  std::uint64_t random_;       // of the loss' chain
  std::uint8_t state_ = 1;     // of the chain: 1 to 4, or 1 good and 2 bad
  std::uint32_t counter_ = 0;  // messages since the last that was reordered
  bool cut_ = false;
  Counts counts_;
  std::uint64_t number_ = 0;
  std::int64_t last_arrival_ns_ = 0;  // the latest of those under way
  std::size_t most_bytes_;
  std::vector<Slot> queue_;  // a heap of under_way(), then the places that are free
  std::size_t free_;
  std::vector<std::byte> bytes_;
};

}  // namespace tandem::remote
