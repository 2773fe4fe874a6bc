// The interposed functions. Each notes itself and calls the C library's own.
#include "rt/trap_calls.hpp"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <ctime>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TANDEM_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || \
    __has_feature(realtime_sanitizer) || __has_feature(memory_sanitizer)
#define TANDEM_SANITIZED 1
#endif
#endif

#ifdef TANDEM_SANITIZED

namespace tandem::rt {
bool traps_calls() noexcept { return false; }
}  // namespace tandem::rt

#else

namespace tandem::rt {
bool traps_calls() noexcept { return true; }
}  // namespace tandem::rt

using tandem::rt::note_trapped_call;

// glibc's own entry points, which need no dlsym (dlsym allocates).
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

// operator new and delete of libstdc++ come through these as well.
void* malloc(std::size_t size) {
  note_trapped_call("malloc");
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note_trapped_call("calloc");
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  note_trapped_call("realloc");
  return __libc_realloc(block, size);
}
void free(void* block) {
  if (block == nullptr) return;
  note_trapped_call("free");
  __libc_free(block);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note_trapped_call("memalign");
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note_trapped_call("aligned_alloc");
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  note_trapped_call("posix_memalign");
  if (alignment < sizeof(void*) || (alignment & (alignment - 1)) != 0) return EINVAL;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
}

namespace {

// The next definition of `name` after this executable's own.
template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// Looked up once, on first use: a look-up inside the cycle is as wrong as the call itself.
#define TANDEM_TRAP(result, name, parameters, arguments)      \
  extern "C" result name parameters {                         \
    static auto* const real = next<result parameters>(#name); \
    note_trapped_call(#name);                                 \
    return real arguments;                                    \
  }

TANDEM_TRAP(int, pthread_mutex_lock, (pthread_mutex_t * mutex), (mutex))
TANDEM_TRAP(int, pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* mutex),
            (condition, mutex))
TANDEM_TRAP(int, pthread_cond_timedwait,
            (pthread_cond_t * condition, pthread_mutex_t* mutex, const timespec* until),
            (condition, mutex, until))
TANDEM_TRAP(int, pthread_cond_clockwait,
            (pthread_cond_t * condition, pthread_mutex_t* mutex, clockid_t clock,
             const timespec* until),
            (condition, mutex, clock, until))
TANDEM_TRAP(int, pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
TANDEM_TRAP(int, pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
TANDEM_TRAP(int, pthread_create,
            (pthread_t * thread, const pthread_attr_t* how, void* (*run)(void*), void* argument),
            (thread, how, run, argument))
TANDEM_TRAP(int, pthread_join, (pthread_t thread, void** result), (thread, result))
TANDEM_TRAP(int, sem_wait, (sem_t * semaphore), (semaphore))
TANDEM_TRAP(int, nanosleep, (const timespec* duration, timespec* rest), (duration, rest))
TANDEM_TRAP(int, clock_nanosleep,
            (clockid_t clock, int flags, const timespec* until, timespec* rest),
            (clock, flags, until, rest))
TANDEM_TRAP(int, usleep, (useconds_t duration_us), (duration_us))
TANDEM_TRAP(ssize_t, write, (int file, const void* data, std::size_t size), (file, data, size))
TANDEM_TRAP(ssize_t, read, (int file, void* data, std::size_t size), (file, data, size))

#endif
