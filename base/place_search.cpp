#include "base/place_search.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <new>
#include <span>
#include <string_view>

#include "base/utf8.hpp"

namespace tandem {
namespace {

constexpr std::size_t kMostFound = 80;
constexpr std::size_t kMostWritten = 16;

template <std::size_t size>
void copy_text(const char* from, std::array<char, size>& to) noexcept {
  const std::string_view fits = whole_characters(from == nullptr ? "" : from, size - 1);
  to[fits.copy(to.data(), fits.size())] = '\0';
}

void say(int fd, const char* text) noexcept { (void)!::write(fd, text, std::strlen(text)); }

/// In the program itself.
void here() {}

}  // namespace

/// Written by the child. A line is there for others once its call names it, directly or by others.
struct PlaceSearch::Shared {
  Shared() {
    for (auto& one : first) one.store(-1, std::memory_order_relaxed);
  }
  std::array<std::atomic<std::int32_t>, std::tuple_size_v<decltype(CallStack::calls)>> first;
  std::array<Line, kMostFound> lines;
  std::array<std::array<char, 512>, std::tuple_size_v<decltype(CallStack::calls)>> symbols;
  // The child's.
  std::int32_t count = 0;
  std::array<const char*, kMostFound> whole_names;
};

std::string CrashPlace::in_function() const {
  const std::string at = offset.empty() ? "" : " (" + offset + ")";
  if (!function.empty()) return " in " + function + at;
  return offset.empty() ? "" : " at " + offset;
}

CallPlaceView PlaceSearch::Line::view() const noexcept {
  const char* const function = clear_name[0] != '\0' ? clear_name.data() : name.data();
  return {.call = call,
          .function = *function == '\0' ? nullptr : function,
          .file = file[0] == '\0' ? nullptr : file.data(),
          .line = number};
}

PlaceSearch::PlaceSearch() {
  void* const memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory != MAP_FAILED) shared_ = new (memory) Shared;
}

bool PlaceSearch::note(const CallStack& stack, bool (*is_authors)(std::uintptr_t)) noexcept {
  if (begun_.exchange(true)) return false;
  stack_ = stack;
  const auto calls = stack_.view();
  const void* const program = library_of(reinterpret_cast<std::uintptr_t>(&here));
  std::size_t chosen = calls.size();
  for (std::size_t i = 0; i < calls.size(); ++i) {
    is_authors_[i] = is_authors(calls[i]);
    if (is_authors_[i] && chosen == calls.size()) chosen = i;
    if (is_authors_[i] || library_of(calls[i]) == program) inner_ = i + 1;
  }
  if (inner_ == 0) inner_ = calls.size();
  if (!calls.empty()) {
    constexpr std::string_view kAt = " at ";
    const std::uintptr_t call = calls[chosen == calls.size() ? 0 : chosen];
    write_offset(call, std::span(noted_).subspan(kAt.copy(noted_.data(), kAt.size())));
    if (noted_[kAt.size()] == '\0') noted_[0] = '\0';
  }
  is_noted_.store(true, std::memory_order_release);
  return true;
}

void PlaceSearch::look(const ChildTime& time) noexcept {
  if (shared_ != nullptr) (void)run_in_child(&look_in_child, this, time);
}

void PlaceSearch::add(std::size_t call, const CallPlaceView& place) noexcept {
  if (shared_->count == static_cast<std::int32_t>(kMostFound)) return;
  const std::int32_t index = shared_->count++;
  Line& line = shared_->lines[static_cast<std::size_t>(index)];
  line.call = place.call;
  shared_->whole_names[static_cast<std::size_t>(index)] = place.function;
  copy_text(place.function, line.name);
  copy_text(place.file, line.file);
  line.number = place.line;
  line.next.store(-1, std::memory_order_relaxed);
  std::atomic<std::int32_t>* last = &shared_->first[call];
  for (std::int32_t at = last->load(); at >= 0; at = last->load())
    last = &shared_->lines[static_cast<std::size_t>(at)].next;
  last->store(index, std::memory_order_release);
}

/// The author's library first, then the program and what is called between; names in clear at last,
/// as they need the heap, whose lock the thread that crashed may have.
void PlaceSearch::look_in_child(void* self) {
  auto& search = *static_cast<PlaceSearch*>(self);
  PlaceReader reader(true);
  struct Job {
    PlaceSearch& search;
    std::size_t call = 0;
  } job{search};
  const auto found = [](void* to, const CallPlaceView& place) {
    auto& of = *static_cast<Job*>(to);
    of.search.add(of.call, place);
  };
  const auto calls = search.stack_.view();
  for (std::size_t i = 0; i < calls.size(); ++i)
    copy_text(symbol_of(calls[i]).function, search.shared_->symbols[i]);
  for (const bool authors : {true, false}) {
    for (job.call = 0; job.call < search.inner_; ++job.call)
      if (search.is_authors_[job.call] == authors) reader.read(calls[job.call], found, &job);
  }
  for (job.call = search.inner_; job.call < calls.size(); ++job.call)
    search.add(job.call,
               {.call = calls[job.call], .function = search.shared_->symbols[job.call].data()});
  for (std::size_t i = 0; i < static_cast<std::size_t>(search.shared_->count); ++i) {
    const char* const name = search.shared_->whole_names[i];
    if (name != nullptr) write_clear_name(name, search.shared_->lines[i].clear_name);
  }
}

/// Places of each call that were found; a call whose place is not known has its symbol.
/// @param use  (index of the call, its place); false: no more
template <class Use>
void PlaceSearch::each_line(const Use& use) const {
  const auto calls = stack_.view();
  for (std::size_t i = 0; i < calls.size(); ++i) {
    std::int32_t at = shared_ == nullptr ? -1 : shared_->first[i].load(std::memory_order_acquire);
    if (at < 0) {
      const char* const symbol = shared_ == nullptr ? "" : shared_->symbols[i].data();
      if (!use(i, {.call = calls[i], .function = *symbol == '\0' ? nullptr : symbol})) return;
    }
    while (at >= 0) {
      const Line& line = shared_->lines[static_cast<std::size_t>(at)];
      if (!use(i, line.view())) return;
      at = line.next.load(std::memory_order_acquire);
    }
  }
}

void PlaceSearch::write(int fd, const char* title) const noexcept {
  std::size_t lines = 0;
  each_line([&](std::size_t, const CallPlaceView& place) {
    if (lines == 0) {
      say(fd, title);
      say(fd, "\n");
    }
    std::array<char, 4096> text;
    write_place(place, text);
    say(fd, "  ");
    say(fd, text.data());
    say(fd, "\n");
    return ++lines < kMostWritten;
  });
}

CrashPlace PlaceSearch::place() const {
  CallPlaceView innermost, authors, own;
  each_line([&](std::size_t call, const CallPlaceView& place) {
    if (innermost.call == 0) innermost = place;
    if (!is_authors_[call]) return true;
    if (authors.call == 0) authors = place;
    if (place.file == nullptr || std::string_view(place.file).starts_with("/usr/")) return true;
    own = place;
    return false;
  });
  const CallPlaceView& chosen = own.call != 0 ? own : authors.call != 0 ? authors : innermost;
  std::array<char, kLongestClearName + 1> clear{};
  const bool is_linkers = chosen.function != nullptr && std::strncmp(chosen.function, "_Z", 2) == 0;
  if (is_linkers) write_clear_name(chosen.function, clear);  // the child did not come to it
  const char* const name = clear[0] != '\0' ? clear.data() : chosen.function;
  std::array<char, 256> offset{};
  if (chosen.call != 0) write_offset(chosen.call, offset);
  return {.function = name == nullptr ? "" : name,
          .file = chosen.file == nullptr ? "" : chosen.file,
          .line = chosen.line,
          .offset = offset.data()};
}

}  // namespace tandem
