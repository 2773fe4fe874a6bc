#include "apps/run/task_queue.hpp"

#include <algorithm>
#include <chrono>

namespace tandem::apps {

Result<Json> TaskQueue::run(Work work) {
  const auto task = std::make_shared<Task>();
  task->work = std::move(work);
  std::unique_lock lock(mutex_);
  waiting_.push_back(task);
  finished_.wait_for(lock, std::chrono::seconds(2), [&] { return task->done; });
  if (task->done) return task->result;
  std::erase(waiting_, task);
  return fail("the process is busy and did not answer within 2 s", "try again");
}

void TaskQueue::run_waiting() {
  const std::lock_guard lock(mutex_);
  for (const auto& task : waiting_) {
    task->result = task->work();
    task->done = true;
  }
  if (!waiting_.empty()) finished_.notify_all();
  waiting_.clear();
}

}  // namespace tandem::apps
