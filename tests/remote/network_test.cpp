// The network's model against what its parameters mean, by formulas of their own.
#include "hal/remote/network.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>

namespace tandem::remote {
namespace {

constexpr std::size_t kMessages = 200'000;
constexpr std::int64_t kStep_ns = 1'000'000;

std::span<const std::byte> bytes_of(const std::uint64_t& number) {
  return std::as_bytes(std::span(&number, 1));
}
std::uint64_t number_of(std::span<const std::byte> bytes) {
  std::uint64_t number = 0;
  std::memcpy(&number, bytes.data(), sizeof number);
  return number;
}

struct Arrival {
  std::uint64_t number;
  std::int64_t time_ns;
};

/// Numbers are sent, one each millisecond, and looked for each `look_ns`.
std::vector<Arrival> play(const NetworkConfig& config, std::size_t messages = kMessages,
                          std::int64_t look_ns = kStep_ns, std::uint64_t seed = 1) {
  EXPECT_TRUE(check(config)) << check(config).error().to_string();
  Network network(config, seed, 8);
  std::vector<Arrival> arrivals;
  std::int64_t now = 0;
  const auto look = [&] {
    for (auto one = network.receive(now); !one.empty(); one = network.receive(now)) {
      arrivals.push_back({number_of(one), now});
    }
  };
  for (std::uint64_t i = 0; i < messages; ++i) {
    (void)network.send(now, bytes_of(i));
    const std::int64_t end = now + kStep_ns;
    for (look(); now + look_ns < end;) {
      now += look_ns;
      look();
    }
    now = end;
  }
  now += 1'000'000'000'000;
  look();
  return arrivals;
}

/// Which of the messages were lost.
std::vector<bool> losses(const NetworkConfig& config) {
  std::vector<bool> lost(kMessages, true);
  for (const Arrival& one : play(config)) lost[one.number] = false;
  return lost;
}

double share_of(const std::vector<bool>& lost) {
  return static_cast<double>(std::ranges::count(lost, true)) / static_cast<double>(lost.size());
}

double mean_burst(const std::vector<bool>& lost) {
  std::size_t bursts = 0;
  for (std::size_t i = 0; i < lost.size(); ++i) bursts += lost[i] && (i == 0 || !lost[i - 1]);
  return static_cast<double>(std::ranges::count(lost, true)) / static_cast<double>(bursts);
}

TEST(Network, WithoutParametersPassesEverythingAtOnce) {
  const auto arrivals = play({}, 100);
  ASSERT_EQ(arrivals.size(), 100U);
  for (std::uint64_t i = 0; i < 100; ++i) {
    EXPECT_EQ(arrivals[i].number, i);
    EXPECT_EQ(arrivals[i].time_ns, static_cast<std::int64_t>(i) * kStep_ns);
  }
}

TEST(Network, IsAFunctionOfItsSeed) {
  const NetworkConfig config{.delay_s = 0.01,
                             .jitter_s = 0.004,
                             .distribution = DelayDistribution::kParetoNormal,
                             .loss = 0.1,
                             .duplicate = 0.1};
  const auto a = play(config, 5000), b = play(config, 5000), c = play(config, 5000, kStep_ns, 2);
  const auto same = [](const Arrival& one, const Arrival& other) {
    return one.number == other.number && one.time_ns == other.time_ns;
  };
  EXPECT_TRUE(std::ranges::equal(a, b, same));
  EXPECT_FALSE(std::ranges::equal(a, c, same));
}

TEST(Network, LosesBurstsOfGilbertElliott) {
  // A burst has ended with each message by r: 1/r long on average, p/(p+r) are lost.
  NetworkConfig config{.loss_model = LossModel::kGilbertElliott, .to_bad = 0.02, .to_good = 0.25};
  std::vector<bool> lost = losses(config);
  EXPECT_NEAR(mean_loss(config), 0.02 / 0.27, 1e-15);
  EXPECT_NEAR(share_of(lost), 0.02 / 0.27, 0.003);
  EXPECT_NEAR(mean_burst(lost), 4.0, 0.15);
  config.loss_in_bad = 0.5;
  config.loss_in_good = 0.01;
  EXPECT_NEAR(mean_loss(config), (0.02 * 0.5 + 0.25 * 0.01) / 0.27, 1e-15);
  EXPECT_NEAR(share_of(losses(config)), mean_loss(config), 0.003);
}

TEST(Network, LosesByFourStates) {
  // Alone: by p14. In bursts: state 3 left by p31 + p32, entered again from 2.
  NetworkConfig config{.loss_model = LossModel::kMarkov, .p14 = 0.05};
  EXPECT_NEAR(mean_loss(config), 0.05 / 1.05, 1e-15);
  std::vector<bool> lost = losses(config);
  EXPECT_NEAR(share_of(lost), 0.05 / 1.05, 0.002);
  EXPECT_EQ(mean_burst(lost), 1.0) << "after one that is lost alone comes one that is not";
  config = {.loss_model = LossModel::kMarkov, .p13 = 0.01, .p31 = 0.1, .p32 = 0.1, .p23 = 0.5};
  // Shares relative to state 1: state 3 has 0.01/0.1, state 2 has that times 0.1/0.5.
  EXPECT_NEAR(mean_loss(config), 0.1 / (1.0 + 0.1 + 0.02), 1e-15);
  lost = losses(config);
  EXPECT_NEAR(share_of(lost), mean_loss(config), 0.006);
  EXPECT_NEAR(mean_burst(lost), 1.0 / 0.2, 0.2);
}

TEST(Network, LosesAtRandomWithCorrelation) {
  EXPECT_NEAR(share_of(losses({.loss = 0.2})), 0.2, 0.004);
  EXPECT_NEAR(mean_burst(losses({.loss = 0.2})), 1.0 / 0.8, 0.02);
  // Correlated numbers are nearer to a half: as netem, it loses less, in longer bursts.
  const std::vector<bool> lost = losses({.loss = 0.2, .loss_correlation = 0.5});
  EXPECT_LT(share_of(lost), 0.15);
  EXPECT_GT(mean_burst(lost), 1.1 / (1.0 - share_of(lost)));
}

TEST(Network, CorrelatedNumbersAreAFirstOrderFilter) {
  CorrelatedRandom random(0.6, 7);
  std::vector<double> x(kMessages);
  for (double& one : x) one = random.next();
  const double n = static_cast<double>(x.size());
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / n;
  double variance = 0.0, lag = 0.0;
  for (std::size_t i = 1; i < x.size(); ++i) {
    variance += (x[i] - mean) * (x[i] - mean) / n;
    lag += (x[i] - mean) * (x[i - 1] - mean) / n;
  }
  EXPECT_NEAR(mean, 0.5, 0.003);
  EXPECT_NEAR(variance, (1.0 - 0.6) / (1.0 + 0.6) / 12.0, 3e-4);
  EXPECT_NEAR(lag / variance, 0.6, 0.01);
}

struct Moments {
  double mean_ms, deviation_ms;
};

Moments moments(DelayDistribution distribution) {
  const NetworkConfig config{
      .delay_s = 0.1, .jitter_s = 0.01, .distribution = distribution, .limit = 2000};
  std::vector<double> delays;
  for (const Arrival& one : play(config, 40'000, 10'000)) {
    if (one.number + 1000 > 40'000) continue;  // the last are looked for once, much later
    delays.push_back(
        1e-6 * static_cast<double>(one.time_ns - static_cast<std::int64_t>(one.number) * kStep_ns));
  }
  const double n = static_cast<double>(delays.size());
  const double mean = std::accumulate(delays.begin(), delays.end(), 0.0) / n;
  double square = 0.0;
  for (const double one : delays) square += (one - mean) * (one - mean) / n;
  return {mean, std::sqrt(square)};
}

TEST(Network, DelaysHaveTheMomentsOfTheirDistribution) {
  const Moments uniform = moments(DelayDistribution::kUniform);
  EXPECT_NEAR(uniform.mean_ms, 100.0, 0.12);
  EXPECT_NEAR(uniform.deviation_ms, 10.0 / std::sqrt(3.0), 0.06);
  const Moments normal = moments(DelayDistribution::kNormal);
  EXPECT_NEAR(normal.mean_ms, 100.0, 0.2);
  EXPECT_NEAR(normal.deviation_ms, 10.0, 0.12);
  // X with P(X > x) = x^-3, cut at 4.5: E X = 3/2 - 1/(2 c^2), E X^2 = 3 - 2/c.
  const double c = 4.5, first = 1.5 - 0.5 / (c * c), second = 3.0 - 2.0 / c;
  const Moments pareto = moments(DelayDistribution::kPareto);
  EXPECT_NEAR(pareto.mean_ms, 100.0 + 40.0 / 3.0 * (first - 1.5), 0.2);
  EXPECT_NEAR(pareto.deviation_ms, 40.0 / 3.0 * std::sqrt(second - first * first), 0.15);
  const Moments both = moments(DelayDistribution::kParetoNormal);
  EXPECT_NEAR(both.mean_ms, 100.0 + 10.0 * (first - 1.5), 0.2);
  EXPECT_GT(both.deviation_ms, 8.0);
  EXPECT_LT(both.deviation_ms, 0.25 * 10.0 + 0.75 * pareto.deviation_ms + 0.1);
}

bool in_order(const std::vector<Arrival>& arrivals) {
  return std::ranges::is_sorted(arrivals, {}, &Arrival::number);
}

TEST(Network, JitterOvertakesUnlessTheOrderIsKept) {
  NetworkConfig config{.delay_s = 0.02, .jitter_s = 0.01};
  EXPECT_FALSE(in_order(play(config, 1000)));
  config.keeps_order = true;
  const auto kept = play(config, 1000);
  EXPECT_TRUE(in_order(kept));
  EXPECT_EQ(kept.size(), 1000U);
}

TEST(Network, ReordersAShareOfEveryGapth) {
  NetworkConfig config{.delay_s = 0.05, .reorder = 0.25};
  const auto count = [](const NetworkConfig& one) {
    Network network(one, 3, 8);
    for (std::uint64_t i = 0; i < 50'000; ++i) {
      const auto now = static_cast<std::int64_t>(i) * kStep_ns;
      (void)network.send(now, bytes_of(i));
      while (!network.receive(now).empty()) {
      }
    }
    return static_cast<double>(network.counts().reordered) / 50'000.0;
  };
  EXPECT_NEAR(count(config), 0.25, 0.01);
  // Messages stay in order for a run of `gap - 1`, then each is reordered by 1/4: one of 4 + 4.
  config.gap = 5;
  EXPECT_NEAR(count(config), 1.0 / 8.0, 0.005);
  EXPECT_FALSE(in_order(play(config, 1000)));
}

TEST(Network, ARateSpacesMessagesAndALimitDropsThem) {
  // 8 bytes at 32 kbit/s take 2 ms, one comes each ms: the queue fills to its limit.
  const NetworkConfig config{.rate_bit_s = 32'000.0, .limit = 50};
  Network network(config, 1, 8);
  std::vector<std::int64_t> times;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto now = static_cast<std::int64_t>(i) * kStep_ns;
    (void)network.send(now, bytes_of(i));
    while (!network.receive(now).empty()) times.push_back(now);
  }
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_EQ(times[i] - times[i - 1], 2 * kStep_ns);
  EXPECT_EQ(network.under_way(), 50U);
  EXPECT_EQ(network.counts().dropped + times.size() + 50, 1000U);
}

TEST(Network, DuplicatesAndACutAreCounted) {
  const auto doubled = play({.delay_s = 0.01, .duplicate = 0.3}, 10'000);
  EXPECT_NEAR(static_cast<double>(doubled.size()), 13'000.0, 200.0);
  Network network({.delay_s = 0.01}, 1, 8);
  const std::uint64_t number = 5;
  EXPECT_TRUE(network.send(0, bytes_of(number)));
  network.cut(true);
  EXPECT_FALSE(network.send(1, bytes_of(number)));
  EXPECT_FALSE(network.receive(20'000'000).empty()) << "what is under way arrives";
  EXPECT_TRUE(network.receive(20'000'000).empty());
  EXPECT_EQ(network.counts().lost, 1U);
}

TEST(Network, GoesOnFromASnapshot) {
  const NetworkConfig config{.delay_s = 0.02, .jitter_s = 0.02, .loss = 0.2, .limit = 100};
  Network one(config, 9, 8), other(config, 1, 8);
  const auto run = [](Network& network, std::uint64_t from, std::uint64_t to) {
    std::vector<std::uint64_t> seen;
    for (std::uint64_t i = from; i < to; ++i) {
      const auto now = static_cast<std::int64_t>(i) * kStep_ns;
      (void)network.send(now, bytes_of(i));
      for (auto m = network.receive(now); !m.empty(); m = network.receive(now)) {
        seen.push_back(number_of(m));
      }
    }
    return seen;
  };
  (void)run(one, 0, 500);
  Archive out;
  out(one);
  Archive in(out.bytes());
  in(other);
  ASSERT_TRUE(in.ok() && in.at_end());
  EXPECT_EQ(run(one, 500, 900), run(other, 500, 900));
}

TEST(Network, IsACommandOfTc) {
  EXPECT_EQ(tc_command({.delay_s = 0.25,
                        .jitter_s = 0.02,
                        .delay_correlation = 0.25,
                        .distribution = DelayDistribution::kNormal,
                        .loss_model = LossModel::kGilbertElliott,
                        .to_bad = 0.01,
                        .to_good = 0.1,
                        .loss_in_bad = 0.7,
                        .loss_in_good = 0.001,
                        .duplicate = 0.01,
                        .reorder = 0.05,
                        .reorder_correlation = 0.5,
                        .gap = 5,
                        .rate_bit_s = 1e6},
                       "eth0"),
            "tc qdisc add dev eth0 root netem limit 1000 delay 250ms 20ms 25% distribution normal "
            "loss gemodel 1% 10% 70% 0.1% duplicate 1% reorder 5% 50% gap 5 rate 1000000bit");
  EXPECT_EQ(tc_command({.loss = 0.2, .keeps_order = true}, "wlan0"),
            "tc qdisc add dev wlan0 root netem limit 1000 loss random 20% rate 100000000000bit");
  EXPECT_EQ(tc_command({.loss_model = LossModel::kMarkov, .p13 = 0.01, .p31 = 0.1}, "lo"),
            "tc qdisc add dev lo root netem limit 1000 loss state 1% 10% 0% 100% 0%");
}

TEST(Network, RefusesWhatIsNoNetwork) {
  EXPECT_EQ(check({.loss = 1.5}).error().key, "loss");
  EXPECT_EQ(check({.p13 = 0.6, .p14 = 0.6}).error().key, "p14");
  EXPECT_EQ(check({.delay_s = -1.0}).error().key, "delay_s");
  EXPECT_EQ(check({.delay_s = std::nan("")}).error().key, "delay_s");
  EXPECT_EQ(check({.reorder = 0.1}).error().key, "reorder");
  EXPECT_EQ(check({.gap = 0}).error().key, "gap");
  EXPECT_EQ(check({.limit = 0}).error().key, "limit");
}

TEST(Network, HasAnotherDelayAndLossFromNowOn) {
  constexpr double kStays = std::numeric_limits<double>::quiet_NaN();
  constexpr std::int64_t kMs = 1'000'000;
  Network network({.delay_s = 0.1}, 1, 8);
  const std::uint64_t one = 1, two = 2, three = 3;
  EXPECT_TRUE(network.send(0, bytes_of(one)));
  network.change(0.3, kStays, kStays);
  EXPECT_TRUE(network.send(kMs, bytes_of(two)));
  EXPECT_EQ(number_of(network.receive(100 * kMs)), 1U);
  Archive kept;
  network.archive(kept);
  network.change(kStays, kStays, 1.0);
  EXPECT_FALSE(network.send(101 * kMs, bytes_of(three)));
  EXPECT_TRUE(network.receive(300 * kMs).empty());
  EXPECT_EQ(number_of(network.receive(301 * kMs)), 2U);
  Archive load(kept.bytes());  // time goes back
  network.archive(load);
  EXPECT_TRUE(network.send(101 * kMs, bytes_of(three)));
}

}  // namespace
}  // namespace tandem::remote
