// Assignment off, each mapping off, entries, count, assignment entries and count (ETG.1000.6).
#include "hal/ethercat-can/line/slave_plan.hpp"

#include <fmt/format.h>

namespace tandem::hal::ecat {

namespace {

constexpr std::uint16_t kAssignOutputs = 0x1C12;
constexpr std::uint16_t kAssignInputs = 0x1C13;
constexpr std::size_t kMostSlaves = 100;
constexpr std::size_t kMostBytes = 1024;  // of one slave, each way

void add_assignment(std::vector<CoeStep>& steps, std::uint16_t assignment,
                    const std::vector<SlavePdo>& pdos) {
  steps.push_back(coe_write(assignment, 0, std::uint8_t{0}));
  std::uint8_t number = 0;
  for (const SlavePdo& pdo : pdos) {
    if (!pdo.fixed) {
      std::uint8_t entry = 0;
      steps.push_back(coe_write(pdo.index, 0, std::uint8_t{0}));
      for (const std::uint32_t mapped : pdo.entries) {
        steps.push_back(coe_write(pdo.index, ++entry, mapped));
      }
      steps.push_back(coe_write(pdo.index, 0, entry));
    }
    steps.push_back(coe_write(assignment, ++number, pdo.index));
  }
  if (number != 0) steps.push_back(coe_write(assignment, 0, number));
}

}  // namespace

std::size_t bytes_of(const std::vector<SlavePdo>& pdos) {
  std::size_t bits = 0;
  for (const SlavePdo& pdo : pdos) {
    for (const std::uint32_t entry : pdo.entries) bits += entry & 0xFF;
  }
  return (bits + 7) / 8;
}

Status check(const std::vector<SlavePlan>& plans) {
  if (plans.empty() || plans.size() > kMostSlaves) {
    return fail_at("ethercat", fmt::format("{} slaves", plans.size()),
                   fmt::format("a line has 1 to {}", kMostSlaves));
  }
  for (const SlavePlan& plan : plans) {
    for (const auto* pdos : {&plan.outputs, &plan.inputs}) {
      if (bytes_of(*pdos) > kMostBytes) {
        return fail_at("ethercat " + plan.name,
                       fmt::format("its PDOs have {} bytes", bytes_of(*pdos)),
                       fmt::format("{} each way at most", kMostBytes));
      }
    }
    for (const CoeStep& step : plan.steps) {
      if (step.bytes.empty() || step.bytes.size() > 1024) {
        return fail_at("ethercat " + plan.name,
                       fmt::format("the value of {:04X}:{:02X} has {} bytes", step.index, step.sub,
                                   step.bytes.size()),
                       "1 to 1024");
      }
    }
  }
  return {};
}

std::vector<CoeStep> make_steps(const SlavePlan& plan) {
  if (plan.waits_in_preop) return {};
  std::vector<CoeStep> steps = plan.steps;
  if (!plan.outputs.empty()) add_assignment(steps, kAssignOutputs, plan.outputs);
  if (!plan.inputs.empty()) add_assignment(steps, kAssignInputs, plan.inputs);
  return steps;
}

bool matches(const SlavePlan& plan, const ethercat::sii::Identity& found) noexcept {
  const ethercat::sii::Identity& wanted = plan.identity;
  const auto same = [](std::uint32_t want, std::uint32_t is) { return want == 0 || want == is; };
  const bool revision =
      wanted.revision == 0 || (found.revision >> 16 == wanted.revision >> 16 &&
                               (found.revision & 0xFFFF) >= (wanted.revision & 0xFFFF));
  const bool vendor =
      same(wanted.vendor, found.vendor) || found.vendor == ethercat::sii::kNobodysVendor;
  return vendor && same(wanted.product, found.product) && revision &&
         same(wanted.serial, found.serial);
}

}  // namespace tandem::hal::ecat
