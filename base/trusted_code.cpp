// Owner and mode of a library and of every folder above it, and the SHA-256 seal at the end of a
// kernel library's file.
#include "base/trusted_code.hpp"

#include <elf.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string_view>

#include "base/quoting.hpp"
#include "base/sha256.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDigits = 64;
const std::string kSeal = "\ntandem-sha256:";

fs::path program() {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/exe", ignored);
}

/// Whose code runs here already: this user's, root's, the program's owner's.
bool trusted(uid_t user) {
  struct stat own {};
  const bool known = ::stat("/proc/self/exe", &own) == 0;
  return user == ::geteuid() || user == 0 || (known && user == own.st_uid);
}

/// Empty, or what is wrong with the owner or mode of a file or folder.
std::string problem_of(const struct stat& found, std::optional<uid_t> partner = {}) {
  if (!trusted(found.st_uid) && found.st_uid != partner)
    return "belongs to user " + std::to_string(found.st_uid);
  const bool sticky_folder = S_ISDIR(found.st_mode) && (found.st_mode & S_ISVTX) != 0;
  if ((found.st_mode & S_IWOTH) != 0 && !sticky_folder) return "may be changed by everybody";
  const bool own_group = found.st_gid == ::getegid() || found.st_gid == 0;
  if ((found.st_mode & S_IWGRP) != 0 && !sticky_folder && !own_group) {
    return "may be changed by group " + std::to_string(found.st_gid);
  }
  return {};
}

std::unexpected<Error> refuse(const std::string& path, std::string message, std::string hint) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = path, .key = {}});
}

bool is_above_program(const fs::path& folder) {
  const std::string prefix = folder == "/" ? "/" : folder.string() + "/";
  return program().string().starts_with(prefix);
}

/// The first of `folder` and those above it that somebody else may change.
struct OpenFolder {
  fs::path path;
  std::string problem;
  mode_t mode = 0;
};
std::optional<OpenFolder> open_folder(fs::path folder, std::optional<uid_t> partner = {}) {
  struct stat found {};
  for (; !is_above_program(folder); folder = folder.parent_path()) {
    if (::stat(folder.c_str(), &found) != 0) return OpenFolder{folder, "cannot be looked at"};
    if (std::string problem = problem_of(found, partner); !problem.empty()) {
      return OpenFolder{folder, std::move(problem), found.st_mode & 07777};
    }
    if (folder == folder.parent_path()) break;  // without /proc nobody says where the program is
  }
  return std::nullopt;
}

Result<std::string> read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in || !bytes) return refuse(path, "cannot be read", "check the path and its permissions");
  return std::move(bytes).str();
}

/// Where the seal begins; npos: not sealed.
std::size_t seal_at(const std::string& bytes) {
  const std::size_t length = kSeal.size() + kDigits;
  if (bytes.size() < length) return std::string::npos;
  const std::size_t at = bytes.size() - length;
  return bytes.compare(at, kSeal.size(), kSeal) == 0 ? at : std::string::npos;
}

}  // namespace

Status check_trusted_code(const std::string& path) {
  std::error_code error;
  const fs::path file = fs::canonical(path, error);
  struct stat found {};
  if (error || ::stat(file.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) {
    return refuse(path, "there is no such file", "correct the path");
  }
  const std::string hint =
      "code that others may change is not loaded: give it to this user or root, "
      "and take the right to write from others (chmod go-w)";
  if (const std::string problem = problem_of(found); !problem.empty()) {
    return refuse(path, problem, hint);
  }
  const std::optional<OpenFolder> open = open_folder(file.parent_path());
  if (!open) return {};
  return refuse(path, "its folder " + open->path.string() + " " + open->problem, hint);
}

Status check_trusted_folder(const std::string& folder, std::optional<uid_t> partner) {
  std::error_code error;
  const fs::path path = fs::canonical(folder.empty() ? "." : folder, error);
  if (error) return refuse(folder, "there is no such folder", "make it, or correct the path");
  const std::optional<OpenFolder> open = open_folder(path, partner);
  if (!open) return {};
  std::ostringstream mode;
  mode << std::oct << open->mode;
  return refuse(open->path.string(), open->problem + " (its mode is " + mode.str() + ")",
                "give it to this user, and take the right to write from others: chmod go-w " +
                    shell_word(open->path.string()));
}

Status check_whole(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in.tellg()));
  Elf64_Ehdr header{};
  in.seekg(0).read(reinterpret_cast<char*>(&header), sizeof header);
  const std::string_view magic(reinterpret_cast<const char*>(header.e_ident), SELFMAG);
  const bool elf = in.good() && magic == std::string_view(ELFMAG, SELFMAG) &&
                   header.e_ident[EI_CLASS] == ELFCLASS64 &&
                   header.e_phentsize == sizeof(Elf64_Phdr);
  if (!elf) return refuse(path, "is no shared library", "build it again");
  std::uint64_t needed = 0;
  in.seekg(static_cast<std::streamoff>(header.e_phoff));
  for (int i = 0; i < header.e_phnum; ++i) {
    Elf64_Phdr part{};
    in.read(reinterpret_cast<char*>(&part), sizeof part);
    if (!in.good() || part.p_filesz > UINT64_MAX - part.p_offset) {
      return refuse(path, "is cut, or damaged", "build it again, or wait until it is copied");
    }
    needed = std::max(needed, part.p_offset + part.p_filesz);
  }
  if (needed <= size) return {};
  return refuse(path,
                "is cut: " + std::to_string(size) + " of at least " + std::to_string(needed) +
                    " bytes are there",
                "build it again, or wait until it is copied");
}

Status seal_library(const std::string& path) {
  const Result<std::string> bytes = read(path);
  if (!bytes) return std::unexpected(bytes.error());
  std::ofstream out(path, std::ios::binary | std::ios::app);
  out << kSeal << sha256(*bytes) << std::flush;
  if (!out) return refuse(path, "cannot be written", "check permissions and free space");
  return {};
}

Status check_seal(const std::string& path) {
  Result<std::string> bytes = read(path);
  if (!bytes) return std::unexpected(bytes.error());
  const std::size_t at = seal_at(*bytes);
  if (at == std::string::npos) return refuse(path, "is cut short, or was not made by tandem", {});
  const std::string said = bytes->substr(at + kSeal.size());
  bytes->resize(at);
  if (sha256(*bytes) == said) return {};
  return refuse(path, "has been damaged since it was made", {});
}

}  // namespace tandem
