// Whatever bytes stand for a log: what `log info`, `log diff`, `log csv` and `report` make of it is
// an error with a message, or columns of equal length.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <sstream>
#include <string>

#include "log/compare.hpp"
#include "log/csv.hpp"
#include "log/log_file.hpp"
#include "report/run_figures.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem;
using fuzz::require;

/// A file in memory that is written anew for each input.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(::memfd_create(name, 0)) {
    require(descriptor_ >= 0);
    path_ = "/proc/self/fd/" + std::to_string(descriptor_);
  }
  const std::string& write(std::span<const std::uint8_t> bytes) {
    require(::ftruncate(descriptor_, 0) == 0);
    require(::pwrite(descriptor_, bytes.data(), bytes.size(), 0) ==
            static_cast<ssize_t>(bytes.size()));
    return path_;
  }

 private:
  int descriptor_;
  std::string path_;
};

template <class T>
bool good(const Result<T>& result) {
  if (!result) require(!result.error().message.empty());
  return result.has_value();
}

void check_topics(const log::LogFile& file) {
  std::size_t messages = 0;
  for (const log::LoggedTopic& topic : file.topics()) {
    messages += topic.messages;
    std::ostringstream csv;
    (void)good(log::write_csv(file, topic.name, 1, csv));
    if (topic.layout.fields().empty()) continue;
    const hal::Field& last = topic.layout.fields().back();
    const std::size_t index = last.count - 1;
    const auto table = file.read(topic.name, {{last.name, index}}, 2);
    if (good(table)) require(table->columns[0].size() == table->time_s.size());
  }
  require(messages == file.messages());
  (void)good(file.events());
}

void check_run(const std::string& path) {
  const auto run = report::read_run(path);
  if (!good(run)) return;
  require(run->rows() >= 2 && run->rows_before_stop() >= 1);
  for (const auto* columns : {&run->position_rad, &run->reference_rad, &run->base}) {
    for (const auto& column : *columns) require(column.size() == run->rows());
  }
  (void)run->tracking();
  (void)run->feet();
  (void)run->base_placement(run->rows() - 1);
  require(run->positions(0).size() >= run->robot.joints.size());
  (void)report::figures_of(*run, {}, nullptr);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MemoryFile whole("whole"), part("part");
  const std::string& path = whole.write({data, size});
  const auto file = log::LogFile::open(path);
  if (!good(file)) return 0;
  check_topics(*file);
  const auto cut = log::LogFile::open(part.write(std::span(data, size).first(size - size / 8)));
  if (good(cut)) {
    const auto same = log::compare(*file, *file);
    if (good(same)) {
      for (const log::TopicComparison& topic : same->topics) require(topic.equal());
    }
    (void)good(log::compare(*file, *cut));
  }
  check_run(path);
  return 0;
}
