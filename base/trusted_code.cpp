// The way to a library, judged part by part; the library loaded by its descriptor; and the SHA-256
// seal at the end of a kernel library's file.
#include "base/trusted_code.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/file_owner.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "base/sha256.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDigits = 64;
const std::string kSeal = "\ntandem-sha256:";

std::unexpected<Error> refuse(const std::string& path, std::string message, std::string hint) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = path, .key = {}});
}

bool is_above_program(const std::string& folder) {
  const std::string program = program_file();
  return program.starts_with(folder == "/" ? "/" : folder + "/");
}

/// What on a way somebody else may change, and how.
struct Open {
  std::string path, problem;
  mode_t mode = 0;
};

/// Where `path` leads, from the root on. Errors: the system's; the first part that somebody else
/// may change: that is in `open`, too.
Result<Place> trusted_way(const std::string& path, Open& open, std::optional<uid_t> partner = {}) {
  std::error_code gone;  // the working directory, which is an error of the walk
  return walk_path(fs::absolute(path, gone).string(), [&](const Place& part) -> Status {
    if (S_ISDIR(part.found.st_mode) && is_above_program(part.path)) return {};
    std::string problem = who_else_may_change(part.itself.get(), part.found, partner);
    if (problem.empty()) return {};
    open = {part.path, std::move(problem), part.found.st_mode};
    return refuse(part.path, open.problem, {});
  });
}

/// Where the seal begins; npos: not sealed.
std::size_t seal_at(const std::string& bytes) {
  const std::size_t length = kSeal.size() + kDigits;
  if (bytes.size() < length) return std::string::npos;
  const std::size_t at = bytes.size() - length;
  return bytes.compare(at, kSeal.size(), kSeal) == 0 ? at : std::string::npos;
}

template <class T>
bool read_at(const Descriptor& file, std::uint64_t at, T& value) {
  return ::pread(file.get(), &value, sizeof value, static_cast<off_t>(at)) == sizeof value;
}

/// The parts of a library that its loader maps, or the list of what it needs. @pre check_whole()
std::vector<Elf64_Phdr> parts_of(const Descriptor& file, std::uint32_t type) {
  std::vector<Elf64_Phdr> parts;
  Elf64_Ehdr header{};
  if (!read_at(file, 0, header)) return parts;
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    Elf64_Phdr part{};
    if (read_at(file, header.e_phoff + i * sizeof part, part) && part.p_type == type) {
      parts.push_back(part);
    }
  }
  return parts;
}

/// Where the byte of an address is in the file. @return 0: nowhere
std::uint64_t place_of(std::uint64_t address, const std::vector<Elf64_Phdr>& loaded) {
  for (const Elf64_Phdr& part : loaded) {
    if (address >= part.p_vaddr && address - part.p_vaddr < part.p_filesz) {
      return part.p_offset + (address - part.p_vaddr);
    }
  }
  return 0;
}

/// Whether one of the library's search paths or needs has $ORIGIN, its own folder, in it.
bool looks_beside_itself(const Descriptor& file) {
  std::uint64_t names_address = 0;
  std::vector<std::uint64_t> texts;  // in its names
  for (const Elf64_Phdr& list : parts_of(file, PT_DYNAMIC)) {
    for (std::uint64_t at = 0; at < list.p_filesz; at += sizeof(Elf64_Dyn)) {
      Elf64_Dyn entry{};
      if (!read_at(file, list.p_offset + at, entry) || entry.d_tag == DT_NULL) break;
      if (entry.d_tag == DT_STRTAB) names_address = entry.d_un.d_ptr;
      if (entry.d_tag == DT_RPATH || entry.d_tag == DT_RUNPATH || entry.d_tag == DT_NEEDED) {
        texts.push_back(entry.d_un.d_val);
      }
    }
  }
  const std::uint64_t names = place_of(names_address, parts_of(file, PT_LOAD));
  return std::ranges::any_of(texts, [&](std::uint64_t at) {
    std::array<char, PATH_MAX> text{};
    (void)!::pread(file.get(), text.data(), text.size() - 1, static_cast<off_t>(names + at));
    const std::string_view found(text.data());
    return found.contains("$ORIGIN") || found.contains("${ORIGIN}");
  });
}

/// Leads nowhere: "/" and "/." in an order that comes once. The loader takes a library that it has
/// loaded by the same name for the same, and a path, as a descriptor's number, comes again: so no
/// two names are spelt alike.
std::string another_spelling() {
  static std::atomic<std::uint32_t> names{0};
  std::string way;
  const std::uint32_t number = names.fetch_add(1);
  for (std::uint32_t bit = 1U << 23; bit != 0; bit >>= 1) way += (number & bit) != 0 ? "/." : "/";
  return way;
}

/// A name of the descriptor's file. Empty: there is no /proc.
std::string name_of(const Descriptor& file) {
  std::error_code missing;
  const std::string process = fs::read_symlink("/proc/self", missing).string();
  if (missing) return {};
  return "/proc/" + process + another_spelling() + "/fd/" + std::to_string(file.get());
}

/// Puts the real path in the place of the name that a library was loaded by: in debuggers, dladdr()
/// and traces. The loader frees what stands there with free().
void rename(void* library, const std::string& name, const std::string& real) {
  link_map* map = nullptr;
  if (::dlinfo(library, RTLD_DI_LINKMAP, &map) != 0 || map->l_name != name) return;
  char* const copy = ::strdup(real.c_str());
  if (copy != nullptr) std::free(std::exchange(map->l_name, copy));
}

}  // namespace

Result<TrustedCode> TrustedCode::open(const std::string& path) {
  constexpr int kRead = O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC;
  Open open;
  Result<Place> place = trusted_way(path, open);
  if (!place && !open.problem.empty()) {
    const std::string part = S_ISDIR(open.mode)   ? "its folder " + open.path + " "
                             : S_ISLNK(open.mode) ? "the link " + open.path + " "
                                                  : "";
    return refuse(path, part + open.problem,
                  "code that others may change is not loaded: give it to this user or root, "
                  "and take the right to write from others (chmod go-w " +
                      shell_word(open.path) + ")");
  }
  if (!place || !place->itself.valid() || !S_ISREG(place->found.st_mode)) {
    return refuse(path, "there is no such file", "correct the path");
  }
  Descriptor file(::openat(place->folder.get(), place->name.c_str(), kRead));
  struct stat found {};
  if (!file.valid() || ::fstat(file.get(), &found) != 0) {
    return refuse(path, "cannot be read", "check its permissions");
  }
  if (found.st_dev != place->found.st_dev || found.st_ino != place->found.st_ino) {
    return refuse(path, "was exchanged while it was looked at", "try again");
  }
  return TrustedCode(path, std::move(place->path), std::move(file));
}

Status TrustedCode::check_whole() const {
  struct stat found {};
  Elf64_Ehdr header{};
  const bool read = ::fstat(file_.get(), &found) == 0 && read_at(file_, 0, header);
  const std::string_view magic(reinterpret_cast<const char*>(header.e_ident), SELFMAG);
  const bool elf = read && magic == std::string_view(ELFMAG, SELFMAG) &&
                   header.e_ident[EI_CLASS] == ELFCLASS64 &&
                   header.e_phentsize == sizeof(Elf64_Phdr);
  if (!elf) return refuse(path_, "is no shared library", "build it again");
  const auto size = static_cast<std::uint64_t>(found.st_size);
  std::uint64_t needed = 0;
  for (std::uint64_t i = 0; i < header.e_phnum; ++i) {
    Elf64_Phdr part{};
    if (!read_at(file_, header.e_phoff + i * sizeof part, part) ||
        part.p_filesz > UINT64_MAX - part.p_offset) {
      return refuse(path_, "is cut, or damaged", "build it again, or wait until it is copied");
    }
    needed = std::max(needed, part.p_offset + part.p_filesz);
  }
  if (needed <= size) return {};
  return refuse(path_,
                "is cut: " + std::to_string(size) + " of at least " + std::to_string(needed) +
                    " bytes are there",
                "build it again, or wait until it is copied");
}

Status TrustedCode::check_seal() const {
  Result<std::string> bytes = read_all(file_, path_, kMostOtherBytes);
  if (!bytes) return std::unexpected(bytes.error());
  const std::size_t at = seal_at(*bytes);
  if (at == std::string::npos) return refuse(path_, "is cut short, or was not made by tandem", {});
  const std::string said = bytes->substr(at + kSeal.size());
  bytes->resize(at);
  if (sha256(*bytes) == said) return {};
  return refuse(path_, "has been damaged since it was made", {});
}

Result<void*> TrustedCode::load(int flags) const {
  // A debugger opens it by its name, too, when the descriptor may be another file's already.
  const bool by_path = looks_beside_itself(file_) || is_debugged();
  const std::string name = by_path ? another_spelling() + real_ : name_of(file_);
  if (name.empty()) {
    return refuse(path_, "cannot be loaded without /proc", "mount it: mount -t proc proc /proc");
  }
  if (void* library = ::dlopen(name.c_str(), flags)) {
    rename(library, name, real_);
    return library;
  }
  std::string why = ::dlerror();
  if (why.starts_with(name + ": ")) why.erase(0, name.size() + 2);  // is said of the error
  return refuse(path_, "cannot be loaded: " + why, "build it again, and link what it uses");
}

const void* TrustedCode::loaded() const noexcept {
  void* library = ::dlopen(real_.c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (library != nullptr) ::dlclose(library);
  return library;
}

Status check_trusted_folder(const std::string& folder, std::optional<uid_t> partner) {
  Open open;
  const Result<Place> place = trusted_way(folder.empty() ? "." : folder, open, partner);
  if (place && place->itself.valid()) return {};
  if (open.problem.empty()) {
    return refuse(folder, "there is no such folder", "make it, or correct the path");
  }
  std::ostringstream mode;
  mode << std::oct << (open.mode & 07777);
  return refuse(open.path, open.problem + " (its mode is " + mode.str() + ")",
                "give it to this user, and take the right to write from others: chmod go-w " +
                    shell_word(open.path));
}

Status seal_library(const std::string& path) {
  const Result<std::string> bytes = read_file(path, "build it again", kMostOtherBytes);
  if (!bytes) return std::unexpected(bytes.error());
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC));
  if (file.valid() && write_all(file, kSeal + sha256(*bytes)) == 0) return {};
  return refuse(path, "cannot be written", "check permissions and free space");
}

}  // namespace tandem
