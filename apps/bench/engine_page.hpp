// The comparison as a page in Markdown, with its figures.
// Layer: apps/bench.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/bench/contacts.hpp"
#include "apps/bench/flights.hpp"
#include "apps/bench/humanoid_runs.hpp"
#include "apps/text/console.hpp"
#include "report/figure.hpp"

namespace tandem::apps {

class EnginePage {
 public:
  explicit EnginePage(const std::vector<EngineEntry>& entries) : entries_(entries) {}

  void add(const std::string& title, const std::vector<AccelerationRow>& rows);
  void add(const Flight& flight, const std::vector<FlightRow>& rows, double truth_error_rad);
  void add(const Slope& slope, const std::vector<SlopeRow>& rows);
  void add(const std::vector<DropRow>& rows);
  void add(const std::vector<StandRow>& rows);
  void add(const std::string& title, const std::vector<HumanoidRow>& rows);

  /// The page; its figures are in `folder`, relative to it.
  [[nodiscard]] std::string text(const std::string& folder) const;
  [[nodiscard]] const std::vector<report::Figure>& figures() const { return figures_; }
  /// Of --json: one object for each scene, engine and step.
  [[nodiscard]] const Json& json() const { return json_; }
  /// A line for each scene so far: who is the cheapest, and what the others cost.
  [[nodiscard]] const std::vector<std::string>& verdicts() const { return verdicts_; }

 private:
  /// What an engine costs in the cheapest of its steps whose error is at most `error`.
  struct Price {
    const EngineEntry* entry = nullptr;
    double cost = 0.0;
  };
  /// @param unit  of the cost: "us per simulated ms"
  void judge(const std::string& title, const std::string& error, const std::string& unit,
             std::vector<Price> prices);
  void note(const std::string& scene, const EngineEntry& entry, double step_ms,
            const std::string& error_key, double error, double cost_us_per_ms);

  const std::vector<EngineEntry>& entries_;
  std::vector<report::Figure> figures_;
  std::vector<std::string> verdicts_;
  std::string sections_;
  Json json_ = Json::array();
};

}  // namespace tandem::apps
