#include "apps/tools/kernel_sizes.hpp"

#include <cxxabi.h>
#include <elf.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "base/open_file.hpp"

namespace tandem::apps {
namespace {

using Bytes = std::vector<char>;

/// A copy of the plain struct at `offset`; false when it lies beyond the end.
template <class T>
bool read_at(const Bytes& bytes, std::uint64_t offset, T& out) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(T)) return false;
  std::memcpy(&out, bytes.data() + offset, sizeof(T));
  return true;
}

/// The text that starts at `offset`, up to its zero.
std::string text_at(const Bytes& bytes, std::uint64_t offset) {
  if (offset >= bytes.size()) return {};
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(offset);
  return {begin, std::find(begin, bytes.end(), '\0')};
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> text(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? std::string(text.get()) : symbol;
}

/// "v3::(anonymous namespace)::bias_12(double const*)" -> "bias"; empty in another namespace.
std::string kernel_of(const std::string& symbol, const std::string& space) {
  std::string name = demangled(symbol);
  if (!name.starts_with(space + "::")) return {};
  name.erase(0, space.size() + 2);
  const std::string anonymous = "(anonymous namespace)::";
  if (name.starts_with(anonymous)) name.erase(0, anonymous.size());
  name.erase(std::min(name.find_first_of("( ["), name.size()));
  const std::size_t number = name.find_last_not_of("0123456789");
  const bool part = number != std::string::npos && number + 1 < name.size() && name[number] == '_';
  return part ? name.substr(0, number) : name;
}

std::unexpected<Error> refuse(const std::string& library, std::string message) {
  return std::unexpected(Error{std::move(message), "build it again with --force", library, 0, {}});
}

}  // namespace

Result<std::map<std::string, std::uint64_t>> kernel_text_bytes(const std::string& library,
                                                               const std::string& variant) {
  const Result<std::string> bytes_read = read_file(library, "build it again", kMostOtherBytes);
  if (!bytes_read) return std::unexpected(bytes_read.error());
  const Bytes bytes(bytes_read->begin(), bytes_read->end());
  Elf64_Ehdr header{};
  if (!read_at(bytes, 0, header) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
      header.e_ident[EI_CLASS] != ELFCLASS64) {
    return refuse(library, "is not a 64-bit ELF library");
  }
  std::string space = variant;
  std::ranges::replace(space, '-', '_');
  std::map<std::string, std::uint64_t> sizes;
  bool found = false;
  for (std::uint64_t s = 0; s < header.e_shnum; ++s) {
    Elf64_Shdr section{};
    if (!read_at(bytes, header.e_shoff + s * sizeof section, section)) break;
    Elf64_Shdr names{};
    if (section.sh_type != SHT_SYMTAB ||
        !read_at(bytes, header.e_shoff + section.sh_link * sizeof names, names)) {
      continue;
    }
    found = true;
    for (std::uint64_t at = 0; at + sizeof(Elf64_Sym) <= section.sh_size; at += sizeof(Elf64_Sym)) {
      Elf64_Sym symbol{};
      if (!read_at(bytes, section.sh_offset + at, symbol)) break;
      if (ELF64_ST_TYPE(symbol.st_info) != STT_FUNC) continue;
      const std::string kernel = kernel_of(text_at(bytes, names.sh_offset + symbol.st_name), space);
      if (!kernel.empty()) sizes[kernel] += symbol.st_size;
    }
  }
  if (!found) return refuse(library, "has no symbol table, so its sizes are not known");
  return sizes;
}

}  // namespace tandem::apps
