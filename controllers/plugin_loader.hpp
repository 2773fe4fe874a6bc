// Finds, checks and opens a controller's shared library.
// Layer: controllers.  Thread: non-RT only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "controllers/controller.hpp"

namespace tandem {

class TrustedCode;

/// A controller together with the library that its code lives in.
class LoadedController {
 public:
  [[nodiscard]] Controller& operator*() const noexcept { return *controller_; }
  [[nodiscard]] Controller* operator->() const noexcept { return controller_.get(); }
  [[nodiscard]] const ControllerPlugin& plugin() const noexcept { return *plugin_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// Digest of its file as it was opened; empty: it could not be read.
  [[nodiscard]] const std::string& sha256() const noexcept { return sha256_; }

 private:
  friend Result<LoadedController> load_controller(const std::string&,
                                                  const std::vector<std::string>&);
  [[nodiscard]] Status open(const TrustedCode& code, const std::string& name);
  struct Close {
    std::string path;
    void operator()(void* library) const noexcept;
  };
  std::unique_ptr<void, Close> library_;  // outlives controller_
  const ControllerPlugin* plugin_ = nullptr;
  std::unique_ptr<Controller> controller_;
  std::string path_;
  std::string sha256_;
};

/// Where controllers are looked for by name: the folders of the environment variable
/// TANDEM_CONTROLLERS (separated by ':'), then lib/controllers and lib/tandem/controllers beside
/// the folder of the running program.
[[nodiscard]] std::vector<std::string> controller_folders();

/// Whether a library is one of those that come with this program.
[[nodiscard]] bool is_bundled_controller(const std::string& library);

/// The names of the controllers (NAME.so) in `folders`, sorted, each once. Opens none.
[[nodiscard]] std::vector<std::string> available_controllers(
    const std::vector<std::string>& folders);

/// Opens `name`.so from the first of `folders` that has it, or the file `name` itself when it
/// holds a '/'. The library is not opened before its file exists.
///
/// Errors: there is no such file (with the folders searched and the nearest name); others may
/// change it (TrustedCode), found out before it is opened; load_newest()'s; it
/// lacks tandem_controller_plugin(), or that leaves something null, or its create() makes no
/// controller; it was built for another plugin ABI, or by another compiler;
/// it throws. A library that calls exit() ends the process with status 2. `key` of the error is
/// `name`.
[[nodiscard]] Result<LoadedController> load_controller(const std::string& name,
                                                       const std::vector<std::string>& folders);

}  // namespace tandem
