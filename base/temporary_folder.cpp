#include "base/temporary_folder.hpp"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace tandem {

namespace fs = std::filesystem;

namespace {

/// Where TMPDIR leads nowhere, this one cannot be made either.
std::string temporary() {
  std::error_code ignored;
  return fs::temp_directory_path(ignored).string();
}

}  // namespace

TemporaryFolder::TemporaryFolder(const std::string& purpose) {
  const std::string where = temporary();
  if (where.empty()) return;
  std::string name = where + "/tandem-" + purpose + "-XXXXXX";
  if (::mkdtemp(name.data()) != nullptr) path_ = std::move(name);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

Status TemporaryFolder::made() const {
  if (!path_.empty()) return {};
  const std::string where = temporary();
  return fail("no folder can be made in " + (where.empty() ? "the machine's temporary one" : where),
              "set TMPDIR to one that can be written and has room");
}

}  // namespace tandem
