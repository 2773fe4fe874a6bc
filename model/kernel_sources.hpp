// Texts that become part of every kernel library, carried inside the program.
// Layer: model.  Thread: any.
#pragma once

#include <string_view>

namespace tandem::model {

extern const std::string_view kKernelsHeader;    ///< model/kernels.h
extern const std::string_view kTrigSource;       ///< model/kernel_trig.inc
extern const std::string_view kDefaultCompiler;  ///< the C++ compiler that built the program
extern const std::string_view kDefaultLauncher;  ///< ccache, or empty

}  // namespace tandem::model
