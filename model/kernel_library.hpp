// A robot's kernel library, loaded and checked.
// Layer: model.  Thread: non-RT to load; the kernels run on any thread.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "model/kernels.h"

namespace tandem::model {

/// What a library may hold: code for any x86-64, for 2013's and for 2017's.
inline constexpr std::array<const char*, 3> kVariantNames{"baseline", "x86-64-v3", "x86-64-v4"};

/// Keeps the library loaded as long as a copy lives.
class KernelLibrary {
 public:
  KernelLibrary() = default;
  [[nodiscard]] const tandem_kernels& operator*() const { return *kernels_; }
  [[nodiscard]] const tandem_kernels* operator->() const { return kernels_; }
  [[nodiscard]] const tandem_kernels* get() const { return kernels_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  /// SHA-256 of the file that was loaded, in hexadecimal digits.
  [[nodiscard]] const std::string& sha256() const { return sha256_; }

 private:
  friend Result<KernelLibrary> load_kernels(const std::string&, const std::string&,
                                            const std::string&);
  std::shared_ptr<void> handle_;
  const tandem_kernels* kernels_ = nullptr;
  std::string path_, sha256_;
};

/// Loads a library.
///
/// @param hash     what description_hash() says of the robot; empty: not compared.
/// @param variant  "baseline", "x86-64-v3" or "x86-64-v4"; empty: the best that this CPU runs.
/// Errors, with what to do next: the file is missing or no kernel library; others may change it
/// (TrustedCode); it was damaged (check_seal()), found out before it is opened; it was
/// made for another ABI or from another description; this CPU or library lacks the variant.
[[nodiscard]] Result<KernelLibrary> load_kernels(const std::string& path,
                                                 const std::string& hash = {},
                                                 const std::string& variant = {});

}  // namespace tandem::model
