// A former build may stay mapped; the new one is loaded beside it, and shares no variable with it.
#include "controllers/newest_library.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <sys/stat.h>

#include <cstring>
#include <map>
#include <mutex>
#include <tuple>
#include <vector>

namespace tandem {
namespace {

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

/// A variable of the library's own that is one for the whole process. Those of the C++ library,
/// such as std::ranges::iter_move, hold nothing. Empty: there is none.
std::string unique_variable(const TrustedCode& code) {
  const std::string bytes =
      read_all(code.file(), code.real_path(), kMostOtherBytes).value_or(std::string());
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

}  // namespace

Result<void*> load_newest(const TrustedCode& code) {
  static std::mutex mutex;
  static std::map<std::string, Identity> loaded;  // when it was loaded last, by its real path
  const std::lock_guard lock(mutex);
  const Identity now = identity_of(code.file());
  const auto [known, first] = loaded.try_emplace(code.real_path(), now);
  const void* former = !first && known->second != now ? code.loaded() : nullptr;
  if (former != nullptr) {
    if (const std::string name = unique_variable(code); !name.empty()) {
      return fail(
          "was built anew, but its former code stays in this process, and the new one would "
          "use its variable " +
              name,
          "end the run; build it by tandem_add_controller(), or with -fno-gnu-unique");
    }
  }
  Result<void*> library = code.load(RTLD_NOW | RTLD_LOCAL);
  if (!library) return library;
  if (*library == former) {
    dlclose(*library);
    return fail("was overwritten in place while its former code is in this process",
                "end the run; copy a library beside it and rename that, as linkers do");
  }
  known->second = now;
  return library;
}

}  // namespace tandem
