#include "base/loaded_libraries.hpp"

#include <dlfcn.h>
#include <link.h>

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

/// The names of what a library needs.
std::vector<std::string> needs_of(const link_map& library) {
  const char* names = nullptr;
  std::vector<std::string> needs;
  for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
    if (entry->d_tag == DT_STRTAB) names = reinterpret_cast<const char*>(entry->d_un.d_ptr);
  for (const ElfW(Dyn)* entry = library.l_ld; entry->d_tag != DT_NULL; ++entry)
    if (entry->d_tag == DT_NEEDED && names != nullptr)
      needs.emplace_back(names + entry->d_un.d_val);
  return needs;
}

std::string find_outdated(void* library, const std::function<bool(const std::string&)>& leave_out,
                          const std::set<std::string>& replaced, int depth) {
  link_map* map = nullptr;
  if (depth > kDeepest || ::dlinfo(library, RTLD_DI_LINKMAP, &map) != 0) return {};
  for (const std::string& name : needs_of(*map)) {
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

std::string outdated_need(void* library, const std::function<bool(const std::string&)>& leave_out) {
  return find_outdated(library, leave_out, replaced_files(), 0);
}

}  // namespace tandem
