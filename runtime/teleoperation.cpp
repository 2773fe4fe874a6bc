#include "runtime/teleoperation.hpp"

#include <cmath>
#include <filesystem>

#include "base/quoting.hpp"

namespace tandem::runtime {
namespace {

constexpr Range kShare{0.0, 1.0};
constexpr double kPlayoutJitters = 4.0;
constexpr double kPlayoutMargin_s = 0.02;

std::int64_t ns(double seconds) { return std::llround(seconds * 1e9); }

/// [teleoperation.up], [teleoperation.down]: netem's parameters.
remote::NetworkConfig read_network(TomlTable table) {
  using remote::DelayDistribution;
  using remote::LossModel;
  remote::NetworkConfig n;
  n.delay_s = table.number_or("delay_s", n.delay_s, {0.0, 10.0});
  n.jitter_s = table.number_or("jitter_s", n.jitter_s, {0.0, 10.0});
  n.delay_correlation = table.number_or("delay_correlation", n.delay_correlation, kShare);
  const std::string distribution =
      table.choice_or("distribution", "uniform", {"uniform", "normal", "pareto", "paretonormal"});
  n.distribution = distribution == "normal"         ? DelayDistribution::kNormal
                   : distribution == "pareto"       ? DelayDistribution::kPareto
                   : distribution == "paretonormal" ? DelayDistribution::kParetoNormal
                                                    : DelayDistribution::kUniform;
  const std::string model =
      table.choice_or("loss_model", "random", {"random", "markov", "gilbert_elliott"});
  if (model == "random") {
    n.loss = table.number_or("loss", n.loss, kShare);
    n.loss_correlation = table.number_or("loss_correlation", n.loss_correlation, kShare);
  } else if (model == "markov") {
    n.loss_model = LossModel::kMarkov;
    n.p13 = table.number("p13", kShare);
    n.p31 = table.number_or("p31", 1.0 - n.p13, kShare);
    n.p32 = table.number_or("p32", n.p32, kShare);
    n.p23 = table.number_or("p23", n.p23, kShare);
    n.p14 = table.number_or("p14", n.p14, kShare);
  } else {
    n.loss_model = LossModel::kGilbertElliott;
    n.to_bad = table.number("to_bad", kShare);
    n.to_good = table.number_or("to_good", 1.0 - n.to_bad, kShare);
    n.loss_in_bad = table.number_or("loss_in_bad", n.loss_in_bad, kShare);
    n.loss_in_good = table.number_or("loss_in_good", n.loss_in_good, kShare);
  }
  n.duplicate = table.number_or("duplicate", n.duplicate, kShare);
  n.duplicate_correlation =
      table.number_or("duplicate_correlation", n.duplicate_correlation, kShare);
  n.reorder = table.number_or("reorder", n.reorder, kShare);
  n.reorder_correlation = table.number_or("reorder_correlation", n.reorder_correlation, kShare);
  n.gap = static_cast<std::uint32_t>(table.integer_or("gap", 1, 1, 1'000'000));
  n.rate_bit_s = table.number_or("rate_bit_s", n.rate_bit_s, {0.0, 1e12});
  n.limit = static_cast<std::size_t>(table.integer_or("limit", 10'000, 1, 100'000));
  n.keeps_order = table.boolean_or("keeps_order", n.keeps_order);
  if (const Status right = remote::check(n); !right) {
    table.error(right.error().key, right.error().message, right.error().hint);
  }
  table.finish();
  return n;
}

}  // namespace

std::uint64_t playout_cycles(const Teleoperation& t, std::int64_t period_ns) {
  const double down_s = t.link.down.delay_s + kPlayoutJitters * t.link.down.jitter_s;
  const std::int64_t all_ns = t.link.playout_ns + ns(down_s);
  return static_cast<std::uint64_t>((all_ns + period_ns - 1) / period_ns);
}

std::map<std::string, std::string> robot_controller_values(const Teleoperation& t) {
  std::map<std::string, std::string> all;
  for (const ControllerSpec& one : t.robot_controllers) {
    all[one.name] = quoted_text(std::filesystem::path(one.plugin).stem().string());
    for (const auto& [key, value] : one.parameters.values()) all[one.name + "." + key] = value;
  }
  return all;
}

std::optional<Teleoperation> read_teleoperation(TomlTable& root) {
  if (!root.has("teleoperation")) return std::nullopt;
  TomlTable table = root.table("teleoperation");
  Teleoperation read;
  remote::TeleConfig& config = read.link;
  read.real = table.choice_or("link", "modelled", {"modelled", "real"}) == "real";
  config.predict = table.boolean_or("predict", config.predict);
  config.up = read_network(table.table_or_empty("up"));
  config.down = read_network(table.table_or_empty("down"));
  const double playout_s =
      config.up.delay_s + kPlayoutJitters * config.up.jitter_s + kPlayoutMargin_s;
  config.playout_ns = ns(table.number_or("playout_s", playout_s, {0.0, 60.0}));
  config.unanswered_ns += ns(config.down.delay_s + kPlayoutJitters * config.down.jitter_s);
  config.correction_ns = ns(table.number_or("correction_s", 0.5, {0.001, 60.0}));
  config.brake_ns = ns(table.number_or("brake_s", 0.25, {0.001, 10.0}));
  if (static_cast<double>(config.playout_ns) * 1e-9 < config.up.delay_s) {
    table.error("playout_s", "is less than the delay of commands: none would come in time",
                "leave it out, or make it longer than up.delay_s");
  }
  for (TomlTable& one : table.tables("outage")) {
    const double from_s = one.number("from_s", {0.0, 1e6});
    config.outages.push_back({ns(from_s), ns(one.number_or("to_s", 1e6, {from_s, 1e6}))});
    one.finish();
  }
  for (TomlTable& one : table.tables("robot_controller")) {
    const std::string plugin = one.text("plugin");
    const std::string name = one.text_or("name", std::filesystem::path(plugin).stem().string());
    read.robot_controllers.push_back({plugin, name, true, one.table_or_empty("parameters")});
    one.finish();
  }
  table.finish();
  return read;
}

}  // namespace tandem::runtime
