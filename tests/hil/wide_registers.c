// For run-in-uml on CPUs with AMX: User-Mode Linux 6.1 keeps a process' extended registers in 2,696
// bytes and dies at its first process where the CPU has more of them ("put_fp_registers"), for the
// host refuses a shorter area. Preloaded, this ptrace() reads and writes the whole area and hands
// the kernel its beginning. The tiles of AMX, which nothing in there uses, are said to be unused.
// Linux 6.13 and later do not need it.
#define _GNU_SOURCE
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

// The state-component bitmap XSTATE_BV follows the legacy area of 512 bytes; bits 17 and 18 are
// AMX' (Intel SDM, volume 1, 13.4).
enum { kBitmapAt = 512, kAmx = (1 << 17) | (1 << 18) };

// The guest kernel has one thread that traces, and small stacks.
static unsigned char whole[64 * 1024] __attribute__((aligned(64)));

static long call(long request, pid_t pid, void* address, void* data) {
  return syscall(SYS_ptrace, request, pid, address, data);
}

// Reads all extended registers of `pid` into `whole`; their size, or -1 with errno.
static ssize_t read_whole(pid_t pid) {
  struct iovec area = {whole, sizeof whole};
  if (call(PTRACE_GETREGSET, pid, (void*)NT_X86_XSTATE, &area) < 0) return -1;
  return (ssize_t)area.iov_len;
}

static long get_registers(pid_t pid, struct iovec* guest) {
  const ssize_t size = read_whole(pid);
  if (size < 0) return -1;
  if (guest->iov_len > (size_t)size) guest->iov_len = (size_t)size;
  memcpy(guest->iov_base, whole, guest->iov_len);
  return 0;
}

static long set_registers(pid_t pid, const struct iovec* guest) {
  const ssize_t size = read_whole(pid);
  if (size < 0) return -1;
  if (guest->iov_len > (size_t)size) return errno = EINVAL, -1;
  memcpy(whole, guest->iov_base, guest->iov_len);
  unsigned long long used;
  memcpy(&used, whole + kBitmapAt, sizeof used);
  used &= ~(unsigned long long)kAmx;
  memcpy(whole + kBitmapAt, &used, sizeof used);
  struct iovec area = {whole, (size_t)size};
  return call(PTRACE_SETREGSET, pid, (void*)NT_X86_XSTATE, &area);
}

// In libc's place: the same arguments and result.
long ptrace(enum __ptrace_request request, ...) {
  va_list arguments;
  va_start(arguments, request);
  const pid_t pid = va_arg(arguments, pid_t);
  void* address = va_arg(arguments, void*);
  void* data = va_arg(arguments, void*);
  va_end(arguments);

  if (address == (void*)NT_X86_XSTATE && request == PTRACE_GETREGSET)
    return get_registers(pid, data);
  if (address == (void*)NT_X86_XSTATE && request == PTRACE_SETREGSET)
    return set_registers(pid, data);
  if (request != PTRACE_PEEKTEXT && request != PTRACE_PEEKDATA && request != PTRACE_PEEKUSER)
    return call(request, pid, address, data);
  long word = 0;  // the system call stores it, libc's function returns it
  if (call(request, pid, address, &word) < 0) return -1;
  errno = 0;
  return word;
}
