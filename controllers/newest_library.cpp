// A former build stays mapped under its name; the new one gets another name for the same file.
#include "controllers/newest_library.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <sys/stat.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <tuple>
#include <vector>

namespace tandem {
namespace {

using Identity = std::tuple<dev_t, ino_t, time_t, long, off_t>;

Identity identity_of(const std::string& path) {
  struct stat file {};
  ::stat(path.c_str(), &file);
  return {file.st_dev, file.st_ino, file.st_mtim.tv_sec, file.st_mtim.tv_nsec, file.st_size};
}

/// The path with so many "./" before the file's name.
std::string spelled(const std::string& path, int times) {
  const std::size_t at = path.rfind('/') + 1;
  std::string dots;
  for (int i = 0; i < times; ++i) dots += "./";
  return path.substr(0, at) + dots + path.substr(at);
}

/// `count` items of a file; none when it does not hold them.
template <class Item>
std::vector<Item> items(const std::string& bytes, std::size_t offset, std::size_t count) {
  if (offset > bytes.size() || count > (bytes.size() - offset) / sizeof(Item)) return {};
  std::vector<Item> all(count);
  std::memcpy(all.data(), bytes.data() + offset, count * sizeof(Item));
  return all;
}

/// A variable of the library's own that is one for the whole process. Those of the C++ library,
/// such as std::ranges::iter_move, hold nothing. Empty: there is none.
std::string unique_variable(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const auto header = items<Elf64_Ehdr>(bytes, 0, 1);
  if (header.empty()) return {};
  const auto sections = items<Elf64_Shdr>(bytes, header[0].e_shoff, header[0].e_shnum);
  for (const Elf64_Shdr& one : sections) {
    if (one.sh_type != SHT_DYNSYM || one.sh_link >= sections.size()) continue;
    const Elf64_Shdr& names = sections[one.sh_link];
    const auto text = items<char>(bytes, names.sh_offset, names.sh_size);
    for (const auto& symbol :
         items<Elf64_Sym>(bytes, one.sh_offset, one.sh_size / sizeof(Elf64_Sym))) {
      if (ELF64_ST_BIND(symbol.st_info) != STB_GNU_UNIQUE || symbol.st_shndx == SHN_UNDEF) continue;
      if (symbol.st_name >= text.size()) continue;
      const std::string name(text.data() + symbol.st_name);
      if (name.find("NSt") == std::string::npos && name.find("NKSt") == std::string::npos)
        return name;
    }
  }
  return {};
}

struct Opened {
  Identity file;  ///< when it was opened last
  int times = 0;  ///< its spelling
};

}  // namespace

Result<void*> open_newest(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, Opened> opened;
  const std::lock_guard lock(mutex);
  const Identity now = identity_of(path);
  const auto [known, first] = opened.try_emplace(path, Opened{now});
  void* former = nullptr;
  if (!first && known->second.file != now)
    former = dlopen(spelled(path, known->second.times).c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (former != nullptr) {
    dlclose(former);
    if (const std::string name = unique_variable(path); !name.empty()) {
      return fail(
          "was built anew, but its former code stays in this process, and the new one would "
          "use its variable " +
              name,
          "end the run; build it by tandem_add_controller(), or with -fno-gnu-unique");
    }
    ++known->second.times;
  }
  void* library = dlopen(spelled(path, known->second.times).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    std::string why = dlerror();
    const std::string file = spelled(path, known->second.times) + ": ";
    if (why.starts_with(file)) why.erase(0, file.size());  // is said of the error
    return fail("cannot be loaded: " + why, "build it again, and link what it uses");
  }
  if (library == former) {
    dlclose(library);
    return fail("was overwritten in place while its former code is in this process",
                "end the run; copy a library beside it and rename that, as linkers do");
  }
  known->second.file = now;
  return library;
}

}  // namespace tandem
