#include "base/file_beneath.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "base/open_file.hpp"

namespace tandem {
namespace {

constexpr std::size_t kLongestWay = 1024;

bool is_part(std::string_view part) {
  return !part.empty() && part != "." && part != ".." && part.find('\0') == std::string_view::npos;
}

}  // namespace

Result<std::string> read_beneath(const std::string& folder, std::string_view way,
                                 std::uint64_t most_bytes) {
  constexpr int kFolder = O_PATH | O_DIRECTORY | O_CLOEXEC;
  constexpr int kFile = O_RDONLY | O_NONBLOCK | O_NOCTTY | O_NOFOLLOW | O_CLOEXEC;
  const auto refuse = [](const std::string& why) {
    return fail(why, "name a file of that folder, without links and \"..\" on the way");
  };
  if (way.size() > kLongestWay) return refuse("a path that is too long");
  Descriptor at(::open(folder.empty() ? "." : folder.c_str(), kFolder));
  for (std::string_view rest = way;;) {
    const std::size_t end = std::min(rest.find('/'), rest.size());
    const std::string part(rest.substr(0, end));
    if (!is_part(part)) return refuse("no path within the folder");
    const bool last = end == rest.size();
    const int how = last ? kFile : kFolder | O_NOFOLLOW;
    Descriptor next(at.valid() ? ::openat(at.get(), part.c_str(), how) : -1);
    if (!next.valid()) return refuse(std::string("it cannot be read: ") + std::strerror(errno));
    at = std::move(next);
    if (last) break;
    rest.remove_prefix(end + 1);
  }
  struct stat found {};
  if (::fstat(at.get(), &found) != 0 || !S_ISREG(found.st_mode)) {
    return refuse("this is no regular file");
  }
  if (static_cast<std::uint64_t>(found.st_size) > most_bytes) {
    return fail("the file has more than " + std::to_string(most_bytes) + " bytes",
                "make it smaller");
  }
  return read_all(at, std::string(way), most_bytes);
}

}  // namespace tandem
