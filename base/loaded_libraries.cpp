#include "base/loaded_libraries.hpp"

#include <dlfcn.h>
#include <link.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

namespace tandem {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 16;  // of libraries that need each other

/// Files that are mapped, and that something else stands in the place of.
std::set<std::string> replaced_files() {
  const std::string mark = " (deleted)";
  std::set<std::string> paths;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (!line.ends_with(mark)) continue;
    line.resize(line.size() - mark.size());
    const std::size_t at = line.find('/');
    std::error_code gone;
    if (at != std::string::npos && fs::exists(line.substr(at), gone)) paths.insert(line.substr(at));
  }
  return paths;
}

/// The texts of a library's entries with a tag.
std::vector<std::string> texts_of(const link_map& library, ElfW(Sxword) tag) {
  const char* names = nullptr;
  std::vector<std::string> texts;
  for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
    if (entry->d_tag == DT_STRTAB) names = reinterpret_cast<const char*>(entry->d_un.d_ptr);
  for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
    if (entry->d_tag == tag && names != nullptr) texts.emplace_back(names + entry->d_un.d_val);
  return texts;
}

/// The entry's address, as glibc has put it for its own use.
template <class Word>
const Word* part_of(const link_map& library, ElfW(Sxword) tag) {
  for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
    if (entry->d_tag == tag) return reinterpret_cast<const Word*>(entry->d_un.d_ptr);
  return nullptr;
}

/// By the library's own hash table, without a lock or the heap.
bool has_symbol(const link_map& library, const char* name) {
  const auto* const table = part_of<std::uint32_t>(library, DT_GNU_HASH);
  const auto* const symbols = part_of<ElfW(Sym)>(library, DT_SYMTAB);
  const auto* const names = part_of<char>(library, DT_STRTAB);
  // The kernel's own library has addresses that nobody relocates.
  if (table == nullptr || symbols == nullptr || names == nullptr ||
      reinterpret_cast<std::uintptr_t>(table) < library.l_addr) {
    return false;
  }
  std::uint32_t wanted = 5381;
  for (const char* c = name; *c != '\0'; ++c) wanted = wanted * 33 + static_cast<unsigned char>(*c);
  const std::uint32_t buckets = table[0], first = table[1], filter_words = table[2];
  const std::uint32_t* const bucket = table + 4 + filter_words * (sizeof(ElfW(Addr)) / 4);
  const std::uint32_t* const chain = bucket + buckets;
  for (std::uint32_t at = buckets == 0 ? 0 : bucket[wanted % buckets]; at >= first && at != 0;
       ++at) {
    const std::uint32_t hash = chain[at - first];
    if ((hash | 1U) == (wanted | 1U) && std::strcmp(names + symbols[at].st_name, name) == 0)
      return symbols[at].st_shndx != SHN_UNDEF;
    if ((hash & 1U) != 0) break;
  }
  return false;
}

std::string find_outdated(void* library, const std::function<bool(const std::string&)>& leave_out,
                          const std::set<std::string>& replaced, int depth) {
  link_map* map = nullptr;
  if (depth > kDeepest || ::dlinfo(library, RTLD_DI_LINKMAP, &map) != 0) return {};
  for (const std::string& name : texts_of(*map, DT_NEEDED)) {
    void* const needed =
        leave_out(name) ? nullptr : ::dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD);
    link_map* its = nullptr;
    if (needed == nullptr || ::dlinfo(needed, RTLD_DI_LINKMAP, &its) != 0) continue;
    std::error_code problem;
    std::string found = fs::canonical(its->l_name, problem).string();
    if (!replaced.contains(found)) found = find_outdated(needed, leave_out, replaced, depth + 1);
    ::dlclose(needed);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

std::set<std::string> mapped_libraries() {
  std::set<std::string> paths;
  ::dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* to) {
        const std::string path = info->dlpi_name;
        if (path.find(".so") != std::string::npos)
          static_cast<std::set<std::string>*>(to)->insert(path);
        return 0;
      },
      &paths);
  return paths;
}

std::string needed_as(const std::string& path) {
  std::string name = fs::path(path).filename().string();
  if (!path.starts_with('/')) return name;  // no file: the vDSO, whose names nobody relocates
  void* const library = ::dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return name;
  link_map* map = nullptr;
  if (::dlinfo(library, RTLD_DI_LINKMAP, &map) == 0) {
    const std::vector<std::string> own = texts_of(*map, DT_SONAME);
    if (!own.empty()) name = own.front();
  }
  ::dlclose(library);
  return name;
}

bool is_defined_beside(std::uintptr_t call, const char* symbol) noexcept {
  dl_find_object where{};
  return ::_dl_find_object(reinterpret_cast<void*>(call), &where) == 0 &&
         has_symbol(*where.dlfo_link_map, symbol);
}

std::string outdated_need(void* library, const std::function<bool(const std::string&)>& leave_out) {
  return find_outdated(library, leave_out, replaced_files(), 0);
}

}  // namespace tandem
