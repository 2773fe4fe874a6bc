// Search path, trusted code, ABI (interface version and headers), compiler, in that
// order: no code of a library runs before its owner and mode were checked.
#include "controllers/plugin_loader.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "base/nearest.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "base/sha256.hpp"
#include "base/trusted_code.hpp"
#include "controllers/hosted_call.hpp"
#include "controllers/newest_library.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;

const char kEntry[] = "tandem_controller_plugin";

std::unexpected<Error> refuse(const std::string& name, const std::string& file, std::string message,
                              std::string hint) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = file, .key = name});
}

std::string joined(const std::vector<std::string>& parts) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text.empty() ? "no folder" : text;
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream in(list);
  for (std::string part; std::getline(in, part, ':');) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

/// The folder that holds the program's bin and lib.
fs::path program_prefix() { return fs::path(program_file()).parent_path().parent_path(); }

/// How to get a bundled controller that has not been built; else what resembles the name.
std::string missing_hint(const std::string& name, const std::vector<std::string>& folders) {
  const std::vector<std::string> bundled = split(TANDEM_BUNDLED_CONTROLLERS);
  const fs::path build = program_prefix();
  std::error_code ignored;
  if (std::ranges::find(bundled, name) != bundled.end() &&
      fs::exists(build / "CMakeCache.txt", ignored)) {
    return "build it: cmake --build " + shell_word(build.string()) + " --target controller_" + name;
  }
  const std::string nearest = suggest(name, available_controllers(folders));
  return (nearest.empty() ? nearest : nearest + "; ") +
         "list your own folders in TANDEM_CONTROLLERS, or name the library by a path with a '/'";
}

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Result<std::string> find(const std::string& name, const std::vector<std::string>& folders) {
  if (name.find('/') != std::string::npos) {
    if (is_file(name)) return name;
    return refuse(name, name, "there is no such controller library",
                  "build it, or correct the path");
  }
  for (const std::string& folder : folders) {
    const fs::path path = fs::path(folder) / (name + ".so");
    if (is_file(path)) return path.string();
  }
  return refuse(name, {}, "no such controller in " + joined(folders), missing_hint(name, folders));
}

/// What a library of another ABI says of itself.
std::string built_for(std::uint32_t abi) {
  const std::uint32_t version = abi >> 16;
  if (version == kControllerInterface) {
    return "was built with other headers of controller interface " + std::to_string(version);
  }
  return "was built for controller interface " + std::to_string(version) + ", this program has " +
         std::to_string(kControllerInterface);
}

/// What the macro TANDEM_CONTROLLER fills in, and an entry of its own may have forgotten.
Status check_entry(const ControllerPlugin& plugin, const std::string& name,
                   const std::string& file) {
  const char* missing = plugin.name == nullptr     ? "name"
                        : plugin.doc == nullptr    ? "doc"
                        : plugin.create == nullptr ? "create"
                                                   : nullptr;
  if (missing == nullptr) return {};
  return refuse(name, file, std::string("its entry point leaves `") + missing + "` null",
                "end its source with TANDEM_CONTROLLER(Class, \"name\", \"One line.\")");
}

/// A library of another ABI is only asked for its entry's first two members, which never move.
Status check(const ControllerPlugin& plugin, const std::string& name, const std::string& file) {
  if (plugin.abi != kControllerAbi) {
    return refuse(name, file, built_for(plugin.abi), "build it again with this version's headers");
  }
  const std::string compiler = plugin.compiler == nullptr ? "" : plugin.compiler;
  if (compiler != __VERSION__) {
    return refuse(name, file,
                  "was built by compiler '" + compiler + "', this program by '" + __VERSION__ + "'",
                  "build it again with the same compiler");
  }
  return {};
}

}  // namespace

void LoadedController::Close::operator()(void* library) const noexcept {
  close_library(library, path);
}

std::vector<std::string> controller_folders() {
  std::vector<std::string> folders;
  if (const char* set = std::getenv("TANDEM_CONTROLLERS")) folders = split(set);
  folders.push_back((program_prefix() / "lib/controllers").string());
  folders.push_back((program_prefix() / "lib/tandem/controllers").string());
  return folders;
}

bool is_bundled_controller(const std::string& library) {
  const std::vector<std::string> bundled = split(TANDEM_BUNDLED_CONTROLLERS);
  const fs::path path = library;
  if (std::ranges::find(bundled, path.stem().string()) == bundled.end()) return false;
  std::error_code ignored;
  const fs::path folder = path.parent_path();
  return fs::equivalent(folder, program_prefix() / "lib/controllers", ignored) ||
         fs::equivalent(folder, program_prefix() / "lib/tandem/controllers", ignored);
}

std::vector<std::string> available_controllers(const std::vector<std::string>& folders) {
  std::vector<std::string> names;
  for (const std::string& folder : folders) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
      if (entry.path().extension() == ".so") names.push_back(entry.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

Result<LoadedController> load_controller(const std::string& name,
                                         const std::vector<std::string>& folders) {
  const Result<std::string> file = find(name, folders);
  if (!file) return std::unexpected(file.error());

  const Result<TrustedCode> code = TrustedCode::open(*file);
  if (!code) return refuse(name, *file, code.error().message, code.error().hint);
  if (const Status whole = code->check_whole(); !whole) {
    return refuse(name, *file, "cannot be loaded: it " + whole.error().message, whole.error().hint);
  }
  LoadedController loaded;
  loaded.path_ = *file;
  const Status opened = hosted_call(name, [&] { return loaded.open(*code, name); });
  if (!opened) return std::unexpected(opened.error());
  return loaded;
}

Status LoadedController::open(const TrustedCode& code, const std::string& name) {
  sha256_ = sha256_of(code.file().get());
  const Result<void*> library = load_newest(code);
  if (!library) return refuse(name, path_, library.error().message, library.error().hint);
  library_ = {*library, Close{code.real_path()}};
  using Entry = const ControllerPlugin* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(library_.get(), kEntry));
  if (entry == nullptr) {
    return refuse(name, path_, "has no entry point " + std::string(kEntry) + "()",
                  "end its source with TANDEM_CONTROLLER(Class, \"name\", \"One line.\")");
  }
  plugin_ = entry();
  if (plugin_ == nullptr) {
    return refuse(name, path_, "its entry point " + std::string(kEntry) + "() returns null",
                  "end its source with TANDEM_CONTROLLER(Class, \"name\", \"One line.\")");
  }
  if (Status ok = check(*plugin_, name, path_); !ok) return ok;
  if (Status ok = check_entry(*plugin_, name, path_); !ok) return ok;
  controller_.reset(plugin_->create());
  if (controller_ != nullptr) return {};
  return refuse(name, path_, "its create() returns no controller (null)",
                "return a new object; report what is wrong from configure()");
}

}  // namespace tandem
