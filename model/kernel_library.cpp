// Trusted code with its seal, then ABI, description hash and the best variant for this
// CPU.
#include "model/kernel_library.hpp"

#include <dlfcn.h>

#include <filesystem>

#include "base/sha256.hpp"
#include "base/trusted_code.hpp"

namespace tandem::model {
namespace {

constexpr const char* kBuildHint = "run: tandem model build robot.toml";

std::unexpected<Error> refuse(const std::string& path, std::string message, std::string hint) {
  Error error;
  error.message = std::move(message);
  error.hint = std::move(hint);
  error.file = path;
  return std::unexpected(std::move(error));
}

}  // namespace

Result<KernelLibrary> load_kernels(const std::string& path, const std::string& hash,
                                   const std::string& variant) {
  if (!std::filesystem::exists(path)) return refuse(path, "no such kernel library", kBuildHint);
  const Result<TrustedCode> code = TrustedCode::open(path);
  if (!code) return std::unexpected(code.error());
  if (const Status whole = code->check_seal(); !whole) {
    return refuse(path, whole.error().message, kBuildHint);
  }
  KernelLibrary library;
  library.path_ = path;
  library.sha256_ = sha256_of(code->file().get());
  const Result<void*> handle = code->load(RTLD_NOW | RTLD_LOCAL);
  if (!handle) return refuse(path, handle.error().message, kBuildHint);
  library.handle_ = std::shared_ptr<void>(*handle, [](void* h) { dlclose(h); });
  const auto get =
      reinterpret_cast<decltype(&tandem_kernels_get)>(dlsym(*handle, "tandem_kernels_get"));
  if (get == nullptr) return refuse(path, "is a library, but has no robot's kernels", kBuildHint);
  const tandem_kernels* best = get(nullptr);
  if (best->abi != TANDEM_KERNELS_ABI)
    return refuse(path,
                  "was made for kernel ABI " + std::to_string(best->abi) + ", this program has " +
                      std::to_string(TANDEM_KERNELS_ABI),
                  kBuildHint);
  if (!hash.empty() && hash != best->description_hash)
    return refuse(path, "was made from another description of the robot", kBuildHint);
  library.kernels_ = variant.empty() ? best : get(variant.c_str());
  if (library.kernels_ != nullptr) return library;
  std::string known;
  for (const char* name : kVariantNames)
    if (get(name) != nullptr) known += (known.empty() ? "" : ", ") + std::string(name);
  return refuse(path, "has no variant '" + variant + "' that this CPU runs", "it has: " + known);
}

}  // namespace tandem::model
