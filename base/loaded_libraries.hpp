// The libraries that this process has loaded, and what of them is not the newest any more.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>

namespace tandem {

/// The paths of all of them.
[[nodiscard]] std::set<std::string> mapped_libraries();

/// The name that others need a loaded library by, its DT_SONAME: "libasan.so.8" of a path that ends
/// with "libasan.so". Without one, and of what is not loaded, the path's last part.
[[nodiscard]] std::string needed_as(const std::string& path);

/// Whether the library that a call is in defines `symbol` itself, for others to find. No heap,
/// no lock.
[[nodiscard]] bool is_defined_beside(std::uintptr_t call, const char* symbol) noexcept;

/// A library that `library` needs, itself or by another one, whose file was replaced since it was
/// loaded: by its name the linker takes what it has. Empty: there is none.
/// @param library    a handle of dlopen()
/// @param leave_out  names of libraries that do not count
[[nodiscard]] std::string outdated_need(void* library,
                                        const std::function<bool(const std::string&)>& leave_out);

}  // namespace tandem
