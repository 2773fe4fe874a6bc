#include "apps/run/errands.hpp"

#include <algorithm>
#include <chrono>

namespace tandem::apps {

Result<Json> Errands::ask(Work work) {
  const auto errand = std::make_shared<Errand>();
  errand->work = std::move(work);
  std::unique_lock lock(mutex_);
  waiting_.push_back(errand);
  finished_.wait_for(lock, std::chrono::seconds(2), [&] { return errand->done; });
  if (errand->done) return errand->result;
  std::erase(waiting_, errand);
  return fail("the process is busy and did not answer within 2 s", "try again");
}

void Errands::do_all() {
  const std::lock_guard lock(mutex_);
  for (const auto& errand : waiting_) {
    errand->result = errand->work();
    errand->done = true;
  }
  if (!waiting_.empty()) finished_.notify_all();
  waiting_.clear();
}

}  // namespace tandem::apps
