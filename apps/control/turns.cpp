#include "apps/control/turns.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

namespace tandem::apps {

ControlTurns::ControlTurns(const ControlRegistry& registry, std::function<void()> answered)
    : registry_(&registry), answered_(std::move(answered)) {
  try {
    for (Turn& turn : turns_) turn.thread = std::thread([this, &turn] { work(turn); });
  } catch (const std::system_error&) {  // no more threads: the first ones end, and are waited for
    finish();
    throw;
  }
}

ControlTurns::~ControlTurns() { finish(); }

void ControlTurns::finish() {
  end();
  for (Turn& turn : turns_) {
    if (turn.thread.joinable()) turn.thread.join();
  }
}

void ControlTurns::end() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  for (Turn& turn : turns_) turn.more.notify_all();
  if (urgent().thread.joinable()) urgent().thread.join();
}

ControlTurn ControlTurns::ask(std::uint64_t asker, std::uint64_t number, std::string question,
                              ControlRegistry::Asked how) {
  const ControlTurn turn = registry_->turn_of(question);
  how.after_stop = registry_->last_stop();
  Question asked{asker, number, std::move(question), std::move(how)};
  {
    const std::scoped_lock lock(mutex_);
    Turn& its = turns_[static_cast<std::size_t>(turn)];
    if (&its != &urgent() || !stops_are_over_) {
      its.questions.push_back(std::move(asked));
      its.more.notify_one();
      return turn;
    }
  }
  answer(asked);
  return turn;
}

void ControlTurns::drop(const std::function<bool(std::uint64_t asker)>& gone) {
  const std::scoped_lock lock(mutex_);
  for (const ControlTurn turn : {ControlTurn::kOrdinary, ControlTurn::kLong}) {
    std::erase_if(turns_[static_cast<std::size_t>(turn)].questions,
                  [&](const Question& one) { return gone(one.asker); });
  }
}

std::vector<ControlTurns::Answer> ControlTurns::take() {
  std::vector<Answer> answers;
  const std::scoped_lock lock(mutex_);
  answers.swap(answers_);
  return answers;
}

/// One question after the other. No turn waits for another one.
void ControlTurns::work(Turn& turn) {
  for (;;) {
    std::unique_lock lock(mutex_);
    turn.more.wait(lock, [&] { return ending_ || !turn.questions.empty(); });
    // A stop that came in time is answered: who asked for it must not have to guess.
    if (ending_ && (&turn != &urgent() || turn.questions.empty())) {
      stops_are_over_ |= &turn == &urgent();
      return;
    }
    const Question question = std::move(turn.questions.front());
    turn.questions.pop_front();
    lock.unlock();
    answer(question);
  }
}

void ControlTurns::answer(const Question& question) {
  Answer answer{question.asker, question.number,
                json_text(registry_->answer(question.text, question.how))};
  const std::scoped_lock lock(mutex_);
  answers_.push_back(std::move(answer));
  answered_();
}

}  // namespace tandem::apps
