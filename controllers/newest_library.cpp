// A former build may stay mapped; the new one is loaded beside it, and shares no variable with it.
// What the linker would give it of the program, or of its own former parts, is looked for.
#include "controllers/newest_library.hpp"

#include <cxxabi.h>
#include <dlfcn.h>
#include <elf.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <system_error>
#include <tuple>
#include <vector>

#include "base/loaded_libraries.hpp"
#include "controllers/hosted_call.hpp"

#ifdef __has_feature
#define TANDEM_HAS(sanitizer) __has_feature(sanitizer)
#else
#define TANDEM_HAS(sanitizer) 0
#endif

namespace tandem {
namespace {

namespace fs = std::filesystem;

/// The sanitizers refuse it.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    TANDEM_HAS(address_sanitizer) || TANDEM_HAS(thread_sanitizer)
constexpr int kApart = 0;
#else
constexpr int kApart = RTLD_DEEPBIND;
#endif

using Identity = std::tuple<dev_t, ino_t, time_t, long, off_t>;

Identity identity_of(const Descriptor& file) {
  struct stat found {};
  ::fstat(file.get(), &found);
  return {found.st_dev, found.st_ino, found.st_mtim.tv_sec, found.st_mtim.tv_nsec, found.st_size};
}

/// `count` items of a file; none when it does not hold them.
template <class Item>
std::vector<Item> items(const std::string& bytes, std::size_t offset, std::size_t count) {
  if (offset > bytes.size() || count > (bytes.size() - offset) / sizeof(Item)) return {};
  std::vector<Item> all(count);
  std::memcpy(all.data(), bytes.data() + offset, count * sizeof(Item));
  return all;
}

/// A library's file by its sections, each with the names that it refers to.
class Sections {
 public:
  explicit Sections(const TrustedCode& code)
      : bytes_(read_all(code.file(), code.real_path(), kMostOtherBytes).value_or(std::string())) {
    const auto header = items<Elf64_Ehdr>(bytes_, 0, 1);
    if (!header.empty()) all_ = items<Elf64_Shdr>(bytes_, header[0].e_shoff, header[0].e_shnum);
  }
  /// Calls `take(entry, name_at)` for each entry of the sections of a type.
  template <class Entry, class Take>
  void each(std::uint32_t type, const Take& take) const {
    for (const Elf64_Shdr& one : all_) {
      if (one.sh_type != type || one.sh_link >= all_.size()) continue;
      const Elf64_Shdr& names = all_[one.sh_link];
      const auto text = items<char>(bytes_, names.sh_offset, names.sh_size);
      const auto name_at = [&text](std::uint64_t at) {
        return at < text.size() ? std::string(text.data() + at) : std::string();
      };
      for (const auto& entry : items<Entry>(bytes_, one.sh_offset, one.sh_size / sizeof(Entry)))
        take(entry, name_at);
    }
  }
  /// Whether what a symbol names is written to, if only by the linker: it holds an address.
  [[nodiscard]] bool is_written(const Elf64_Sym& symbol) const {
    return symbol.st_shndx >= all_.size() || (all_[symbol.st_shndx].sh_flags & SHF_WRITE) != 0;
  }

 private:
  std::string bytes_;
  std::vector<Elf64_Shdr> all_;
};

/// Whether a mangled name is one of namespace std, not one that only has a type of std in it.
bool is_of_std(std::string_view name) {
  if (!name.starts_with("_Z")) return false;
  name.remove_prefix(2);
  if (name.starts_with("GV")) name.remove_prefix(2);
  while (name.starts_with('Z') || name.starts_with('N') || name.starts_with('K'))
    name.remove_prefix(1);
  return name.starts_with("St");
}

/// A variable of the library's own that is one for the whole process. Constants of the C++ library,
/// such as std::ranges::iter_move, are the same in every build; what it makes for types of the
/// controller's may lead to its code, as a table of std::visit() does. Empty: there is none.
std::string unique_variable(const Sections& file) {
  std::string found;
  file.each<Elf64_Sym>(SHT_DYNSYM, [&](const Elf64_Sym& symbol, const auto& name_at) {
    if (ELF64_ST_BIND(symbol.st_info) != STB_GNU_UNIQUE || symbol.st_shndx == SHN_UNDEF) return;
    const std::string name = name_at(symbol.st_name);
    if (found.empty() && !(is_of_std(name) && !file.is_written(symbol))) found = name;
  });
  return found;
}

/// "tandem::kPositive" of "_ZN6tandem9kPositiveE".
std::string clear_name(const std::string& symbol) {
  const std::unique_ptr<char, decltype(&std::free)> clear(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, nullptr), std::free);
  return clear == nullptr ? symbol : clear.get();
}

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }
/// "libddsc" of "libddsc.so.0".
std::string stem(const std::string& path) {
  const std::string name = file_name(path);
  return name.substr(0, name.find(".so"));
}

/// What the program itself is linked to: its functions come before those of a controller's.
class OfTheProgram {
 public:
  OfTheProgram() {
    for (const std::string& path : mapped_libraries()) names_[stem(path)] = needed_as(path);
  }
  [[nodiscard]] bool has(const std::string& path) const {
    const auto found = names_.find(stem(path));
    return found != names_.end() && found->second == file_name(path);
  }
  /// Its library that `path` is another version of; empty: there is none.
  [[nodiscard]] std::string other_of(const std::string& path) const {
    const auto found = names_.find(stem(path));
    return found == names_.end() || has(path) ? std::string() : found->second;
  }

 private:
  std::map<std::string, std::string> names_;  // by stem
};

/// Whether the library names one that it needs of which the program has another version.
bool needs_apart(const Sections& file, const OfTheProgram& program) {
  bool found = false;
  file.each<Elf64_Dyn>(SHT_DYNAMIC, [&](const Elf64_Dyn& entry, const auto& name_at) {
    if (entry.d_tag != DT_NEEDED) return;
    found = found || !program.other_of(name_at(entry.d_un.d_val)).empty();
  });
  return found;
}

/// A library that came with this one, and whose calls would go to the program's version of it.
std::string mixed_up(const std::set<std::string>& before, const OfTheProgram& program) {
  for (const std::string& path : mapped_libraries())
    if (!before.contains(path) && !program.other_of(path).empty()) return path;
  return {};
}

/// What the linker has made of it. The library is closed when that will not do.
Status check_needs(void* library, bool apart, const std::set<std::string>& before,
                   const OfTheProgram& program) {
  const std::string mixed = apart ? std::string() : mixed_up(before, program);
  if (!mixed.empty()) {
    dlclose(library);
    return fail(
        "brings " + mixed + ", whose calls would go to the program's " + program.other_of(mixed),
        "link it to the controller itself, too: then both are kept apart");
  }
  const auto of_program = [&program](const std::string& name) { return program.has(name); };
  if (const std::string need = outdated_need(library, of_program); !need.empty()) {
    dlclose(library);
    return fail("needs " + need + ", which was built anew while its former code is in this process",
                "end the run; or link its parts into the controller (STATIC)");
  }
  return {};
}

/// One thread at a time is in the linker, which keeps a lock while a library's own initialisers or
/// clean-up run: one that does not return has it for ever.
struct Linker {
  std::timed_mutex turn;
  std::mutex mutex;  // of what follows: who has the turn
  std::string path;
  GivenUp given_up;
};
Linker& linker() {
  static Linker& one = *new Linker;  // also while the process ends
  return one;
}

/// The turn for a library, as long as it lives.
class LinkerTurn {
 public:
  /// Waits. Errors, by no wait: who has the turn was given up; the one who waits was.
  explicit LinkerTurn(const std::string& path) : turn_(linker().turn, std::defer_lock) {
    constexpr std::chrono::milliseconds kLook{20};
    Linker& its = linker();
    const GivenUp& own = hosted_call_given_up();
    while (!turn_.try_lock_for(kLook)) {
      const std::lock_guard lock(its.mutex);
      if ((own == nullptr || !*own) && (its.given_up == nullptr || !*its.given_up)) continue;
      state_ = fail("cannot be loaded: the process is still in " + its.path +
                        ", which does not return from its static initialisers or its clean-up",
                    "correct that one, and end the run: it loads and frees no library before");
      return;
    }
    const std::lock_guard lock(its.mutex);
    its.path = path;
    its.given_up = own;
  }
  ~LinkerTurn() {
    if (!turn_) return;
    const std::lock_guard lock(linker().mutex);
    linker().given_up.reset();
  }
  LinkerTurn(const LinkerTurn&) = delete;
  LinkerTurn& operator=(const LinkerTurn&) = delete;

  [[nodiscard]] const Status& state() const noexcept { return state_; }

 private:
  std::unique_lock<std::timed_mutex> turn_;
  Status state_;
};

}  // namespace

void close_library(void* library, const std::string& path) noexcept {
  constexpr std::chrono::milliseconds kLimit{4000};
  const auto close = [library, path]() -> Status {
    const LinkerTurn turn(path);
    if (turn.state()) dlclose(library);
    return turn.state();
  };
  try {
    (void)bounded_call(path, kLimit, close);
  } catch (const std::system_error&) {  // there are no more threads
    (void)close();
  }
}

Result<void*> load_newest(const TrustedCode& code) {
  static std::map<std::string, Identity> loaded;  // when it was loaded last, by its real path
  const LinkerTurn turn(code.real_path());
  if (!turn.state()) return std::unexpected(turn.state().error());
  static const OfTheProgram program;
  const Identity now = identity_of(code.file());
  const auto [known, first] = loaded.try_emplace(code.real_path(), now);
  const void* former = !first && known->second != now ? code.loaded() : nullptr;
  const Sections file(code);
  if (former != nullptr) {
    if (const std::string name = unique_variable(file); !name.empty()) {
      return fail(
          "was built anew, but its former code stays in this process, and the new one would "
          "use its variable " +
              clear_name(name),
          "end the run; build it by tandem_add_controller(), or with -fno-gnu-unique");
    }
  }
  const bool apart = kApart != 0 && needs_apart(file, program);
  const std::set<std::string> before = mapped_libraries();
  Result<void*> library = code.load(RTLD_NOW | RTLD_LOCAL | (apart ? kApart : 0));
  if (!library) return library;
  if (*library == former) {
    dlclose(*library);
    return fail("was overwritten in place while its former code is in this process",
                "end the run; copy a library beside it and rename that, as linkers do");
  }
  if (const Status good = check_needs(*library, apart, before, program); !good)
    return std::unexpected(good.error());
  known->second = now;
  return library;
}

}  // namespace tandem
