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
  /// Results for --json: one object for each scene, engine and step.
  [[nodiscard]] const Json& json() const { return json_; }
  /// A line for each scene so far: who is the cheapest, what the others cost, and who is the most
  /// accurate.
  [[nodiscard]] const std::vector<std::string>& verdicts() const { return verdicts_; }

 private:
  /// What an engine costs in the cheapest of its steps whose error is at most `error`, and how
  /// near it comes to the truth.
  struct Price {
    const EngineEntry* entry = nullptr;
    double cost = 0.0;      ///< NaN: no step comes so near
    double error = 0.0;     ///< NaN: diverged, or it is the measure itself
    std::string printed{};  ///< the error as the table has it
  };
  /// What costs and errors of a scene are called.
  struct Words {
    std::string target;    ///< "for an error of 0.005 rad"
    std::string unit;      ///< of the cost: "us per simulated ms"
    std::string accuracy;  ///< "most accurate at 0.125 ms"
    std::string error;     ///< unit of the error: " rad"
  };
  void judge(const std::string& title, const Words& words, std::vector<Price> prices);
  /// "most accurate at 0.125 ms: **tandem rk4**, 2e-13 rad": all whose error is printed the same.
  static std::string most_accurate(const Words& words, const std::vector<Price>& prices);
  void note(const std::string& scene, const EngineEntry& entry, double step_ms,
            const std::string& error_key, double error, double cost_us_per_ms);

  const std::vector<EngineEntry>& entries_;
  std::vector<report::Figure> figures_;
  std::vector<std::string> verdicts_;
  std::string sections_;
  Json json_ = Json::array();
};

}  // namespace tandem::apps
