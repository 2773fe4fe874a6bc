#include "runtime/condition/expectations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <thread>
#include <utility>

namespace tandem::runtime {
namespace {

constexpr auto kLook = std::chrono::microseconds(200);

}  // namespace

std::expected<std::unique_ptr<Expectations>, Diagnostics> Expectations::read(
    std::span<const ExpectationSpec> specs, const std::string& file, const QuantityNames& names) {
  auto all = std::make_unique<Expectations>();
  Diagnostics errors;
  for (const ExpectationSpec& spec : specs) {
    auto one = Expectation::read(spec, names);
    if (one) {
      all->all_.push_back(std::move(*one));
      continue;
    }
    Error error = one.error();
    error.file = file;
    error.key = "expect." + error.key;
    errors.push_back(std::move(error));
  }
  if (!errors.empty()) return std::unexpected(std::move(errors));
  all->shown_ = all->all_;
  return all;
}

void Expectations::take(const hal::CycleView& view) noexcept TANDEM_RT {
  if (looked_at_.load(std::memory_order_acquire)) show();
  started_ = started_ || view.phase == hal::RunPhase::kRunning;
  if (!started_ || ended_ || view.time.time_ns == newest_ns_) return;
  newest_ns_ = view.time.time_ns;
  ended_ = hal::ends(view.phase);
  // A fault that ends the run is noted in the cycle that shuts it down.
  if (ended_ && view.faults == 0) return;
  for (Expectation& one : all_) one.take(view);
}

std::uint64_t Expectations::fingerprint() const noexcept {
  std::uint64_t hash = 0xCBF29CE484222325U;  // FNV-1a
  const auto add = [&hash](std::uint64_t value) { hash = (hash ^ value) * 0x100000001B3U; };
  for (const Expectation& one : all_) {
    const ExpectationSpec& spec = one.spec();
    add(static_cast<std::uint64_t>(spec.kind));
    for (const std::string* text :
         {&spec.text, &spec.above, &spec.below, &spec.after, &spec.log, &spec.within}) {
      for (const char letter : *text) add(static_cast<unsigned char>(letter));
      add(text->size());
    }
    for (const double number : {spec.in_s, spec.from_s, spec.to_s})
      add(std::bit_cast<std::uint64_t>(number));
  }
  return hash;
}

void Expectations::show() noexcept TANDEM_RT {
  for (std::size_t i = 0; i < all_.size(); ++i) shown_[i].follow(all_[i]);
  if (others_ != nullptr) others_->follow();
  looked_at_.store(false, std::memory_order_release);
}

std::optional<std::vector<ExpectationResult>> Expectations::look(std::chrono::nanoseconds at_most) {
  const auto until = std::chrono::steady_clock::now() + at_most;
  looked_at_.store(true, std::memory_order_release);
  while (looked_at_.load(std::memory_order_acquire)) {
    if (std::chrono::steady_clock::now() > until) return std::nullopt;
    std::this_thread::sleep_for(kLook);
  }
  return each(shown_, &Expectation::so_far, true);
}

std::vector<ExpectationResult> Expectations::results() const {
  return each(all_, &Expectation::verdict, false);
}

std::vector<ExpectationResult> Expectations::so_far() const {
  return each(all_, &Expectation::so_far, false);
}

std::vector<ExpectationResult> Expectations::each(const std::vector<Expectation>& all,
                                                  ExpectationResult (Expectation::*result)() const,
                                                  bool followed) const {
  std::vector<ExpectationResult> results;
  for (const Expectation& one : all) results.push_back((one.*result)());
  if (others_ != nullptr) others_->add_results(followed, results);
  return results;
}

std::uint64_t Expectations::awaited_faults() const {
  std::uint64_t causes = 0;
  for (const Expectation& one : all_) causes |= one.awaited_faults();
  return causes;
}

std::size_t failed(std::span<const ExpectationResult> results) {
  return static_cast<std::size_t>(std::ranges::count(results, false, &ExpectationResult::passed));
}

std::string margin_text(const ExpectationResult& result) {
  if (!result.margin) return {};
  return fmt::format("{:.4g}{}{}", *result.margin, result.unit.empty() ? "" : " ", result.unit);
}

std::string in_words(const ExpectationResult& result) {
  if (result.passed && !result.reason.empty()) return result.reason;  // it did not come, and may
  std::string text = result.passed ? "passed" : "failed";
  if (!result.reason.empty()) text += ", " + result.reason;
  if (const std::string margin = margin_text(result); !margin.empty()) text += ", margin " + margin;
  if (!result.joint.empty()) text += " of " + result.joint;
  if (result.at_s) text += fmt::format(" at {:.3f} s", *result.at_s);
  return text;
}

}  // namespace tandem::runtime
