#include "apps/run/input_lease.hpp"

#include <algorithm>

namespace tandem::apps {
namespace {

constexpr std::chrono::milliseconds kLeastSilence{500};  // before another writer may feed

}  // namespace

Status InputLease::check(const std::optional<dds::ParticipantId>& who) const {
  if (parts_.gate) {
    const Status open = parts_.gate("input.set", ControlEffect::kChanges, Json::object());
    if (!open) return open;
  }
  if (parts_.admission.admits(who)) return {};
  return fail("its writer is a stranger",
              "[remote] trust = \"domain\", or `tandem ask` with dds.admit: docs/security.md");
}

Status InputLease::take(const runtime::InputPort& port,
                        const std::optional<dds::ParticipantId>& who, std::uint64_t writer) {
  if (const Status runs = parts_.services.check_runs(port); !runs) return runs;
  if (const Status may = check(who); !may) return may;
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> timeout(port.input().options.timeout_s);
  const auto silence = std::max<std::chrono::duration<double>>(timeout, kLeastSilence);
  const std::lock_guard lock(mutex_);
  const bool same = writer == writer_ && who == participant_;
  if (writer_ != 0 && !same) {
    if (kept_) return fail("a goal of its action is under way", "wait for its end, or cancel it");
    if (now - heard_at_ < silence) {
      return fail("another node feeds it", "one at a time; stop the other one first");
    }
  }
  writer_ = writer;
  participant_ = who;
  heard_at_ = now;
  return {};
}

void InputLease::keep(bool on) {
  const std::lock_guard lock(mutex_);
  kept_ = on;
  heard_at_ = std::chrono::steady_clock::now();
}

}  // namespace tandem::apps
