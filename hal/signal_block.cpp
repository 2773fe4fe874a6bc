#include "hal/signal_block.hpp"

#include <algorithm>
#include <cstring>

#include "base/file_name.hpp"

namespace tandem::hal {
namespace {

/// Why ROS 2 allows no field of that name; empty: it does.
std::string name_problem(const std::string& name) {
  const auto lower = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto good = [&](char c) { return lower(c) || (c >= '0' && c <= '9') || c == '_'; };
  if (name.empty() || name.size() > kLongestFileName || !std::ranges::all_of(name, good) ||
      !lower(name.front()) || name.back() == '_' || name.find("__") != std::string::npos) {
    return "has a name that no field of a message can have";
  }
  if (name == "cycle" || name == "time_ns" || name == "sensor") return "has a name that is taken";
  return {};
}

/// Whether it can stand in one line of a message's definition.
bool is_line(const std::string& text, std::size_t most) {
  return text.size() <= most && std::ranges::none_of(text, [](char c) {
           return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
         });
}

}  // namespace

Status SignalBlock::close() {
  constexpr std::size_t kLongestUnit = 32, kLongestDoc = 200;
  for (const SignalInfo& one : declared_) {
    if (const std::string problem = name_problem(one.name); !problem.empty()) {
      return fail_at(one.name, problem,
                     "take lower-case letters, digits and single _, a letter first, at most " +
                         std::to_string(kLongestFileName) + " characters: \"com_error\"");
    }
    const auto same = std::ranges::count(declared_, one.name, &SignalInfo::name);
    if (same > 1) return fail_at(one.name, "is declared twice", "give each signal its own name");
    if (!is_line(one.unit, kLongestUnit) || one.unit.find(']') != std::string::npos ||
        !is_line(one.doc, kLongestDoc)) {
      return fail_at(one.name, "has a unit or a description that is no short line",
                     "a unit has at most " + std::to_string(kLongestUnit) +
                         " characters and no ], a description at most " +
                         std::to_string(kLongestDoc));
    }
  }
  if (!refused_.empty() && refused_count_ == 0) {
    return fail_at(refused_, "is declared with 0 numbers", "declare at least one");
  }
  if (!refused_.empty()) {
    return fail_at(
        refused_,
        "is one signal too many: it has " + std::to_string(refused_count_) +
            (refused_count_ == 1 ? " number, those before it " : " numbers, those before it ") +
            std::to_string(numbers_),
        "a controller has at most " + std::to_string(kMostNumbers) + " numbers in its signals");
  }
  shown_ = std::make_unique<Seqlock<double>>(words().size());
  publish(0, -1);
  return {};
}

Layout SignalBlock::layout() const {
  Layout layout;
  layout.add("cycle", FieldType::kU64, 1, "of the run");
  layout.add("time_ns", FieldType::kI64, 1, "since the run's first SYNC");
  for (const SignalInfo& one : declared_) {
    std::string doc = "[" + one.unit + (one.by_joint ? "] by joint: " : "] ") + one.doc;
    std::ranges::replace(doc, '#', ' ');
    layout.add(one.name, FieldType::kF64, one.count, std::move(doc));
  }
  return layout;
}

std::vector<std::string> SignalBlock::number_names(std::span<const std::string> joints) const {
  std::vector<std::string> names;
  for (const SignalInfo& one : declared_) {
    for (std::size_t i = 0; i < one.count; ++i) {
      const bool joint = one.by_joint && i < joints.size();
      names.push_back(one.count == 1 && !one.by_joint
                          ? one.name
                          : one.name + "." + (joint ? joints[i] : std::to_string(i)));
    }
  }
  return names;
}

SignalBlock::Look SignalBlock::look() const {
  std::vector<double> words(shown_->size());
  Look look;
  if (!shown_->read(words)) return look;
  look.cycle = std::bit_cast<std::uint64_t>(words[0]);
  look.time_ns = std::bit_cast<std::int64_t>(words[1]);
  look.values.assign(words.begin() + kHead, words.end());
  return look;
}

}  // namespace tandem::hal
