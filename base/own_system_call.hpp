// System calls that belong to the cycle, on sockets that never wait.
// Layer: base.  Thread: any.
#pragma once

/// Until the end of its scope calls are the cycle's own: clang's RealtimeSanitizer takes every
/// system call for a fault. The trap of the unit tests lets through what does not wait.
#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#include <sanitizer/rtsan_interface.h>
#define TANDEM_OWN_SYSTEM_CALL const __rtsan::ScopedDisabler own_system_call
#endif
#endif
#ifndef TANDEM_OWN_SYSTEM_CALL
#define TANDEM_OWN_SYSTEM_CALL static_cast<void>(0)
#endif
