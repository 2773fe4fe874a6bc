#include "apps/search/child_runs.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include "base/process.hpp"
#include "base/quoting.hpp"

namespace tandem::apps {

ChildRuns::ChildRuns(std::size_t jobs, double timeout_s)
    : jobs_(jobs > 0 ? jobs : std::max(1U, std::thread::hardware_concurrency())),
      timeout_s_(timeout_s),
      folder_((std::filesystem::temp_directory_path() / "tandem-runs-XXXXXX").string()) {
  if (::mkdtemp(folder_.data()) == nullptr) folder_.clear();
}

ChildRuns::~ChildRuns() {
  end_all();
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string ChildRuns::file_of(std::size_t files, const char* ending) const {
  return fmt::format("{}/{}{}", folder_, files, ending);
}

Status ChildRuns::start(std::size_t number, std::vector<std::string> words) {
  if (folder_.empty()) {
    return fail(std::string("no folder can be made for the runs: ") + std::strerror(errno),
                "look at the free space and rights of TMPDIR");
  }
  const std::size_t files = started_++;
  words.insert(words.begin(), program_file());
  for (const char* word : {"--quiet", "--json"}) words.emplace_back(word);
  words.push_back(file_of(files, ".json"));
  const auto child =
      spawn({.command = std::move(words), .output = file_of(files, ".txt"), .own_group = true});
  if (!child) return std::unexpected(child.error());
  going_.push_back({.number = number, .files = files, .child = *child, .begin = Clock::now()});
  return {};
}

std::vector<EndedRun> ChildRuns::take_ended() {
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::vector<EndedRun> all;
  std::erase_if(going_, [&](Going& one) {
    int raw = 0;
    if (::waitpid(one.child, &raw, WNOHANG) == one.child) {
      all.push_back(ended(one, exit_status(raw)));
      return true;
    }
    const std::chrono::duration<double> took = Clock::now() - one.begin;
    if (!one.late && took.count() > timeout_s_) {
      one.late = true;
      (void)::kill(-one.child, SIGKILL);
    }
    return false;
  });
  return all;
}

EndedRun ChildRuns::ended(const Going& one, int status) const {
  const std::string json = file_of(one.files, ".json"), said = file_of(one.files, ".txt");
  EndedRun ended{.number = one.number,
                 .run = child_run(json, said, status, one.late ? timeout_s_ : 0.0)};
  std::error_code ignored;  // a search has thousands
  for (const std::string& file : {json, said}) std::filesystem::remove(file, ignored);
  return ended;
}

void ChildRuns::end_all() {
  for (const Going& one : going_) {
    (void)::kill(-one.child, SIGKILL);
    (void)wait_for(one.child);
  }
  going_.clear();
}

std::string command_of_run(const std::string& file, const std::vector<std::string>& more) {
  std::string command = "tandem";
  std::vector<std::string> words = child_words(file);
  words.insert(words.end(), more.begin(), more.end());
  for (const std::string& word : words) command += " " + shell_word(word);
  return command;
}

}  // namespace tandem::apps
