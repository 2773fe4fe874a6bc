// A run with the rights of scripts/tandem@.service and no others: another user than root, two
// capabilities, the listed system calls and address families.
#include <fcntl.h>
#include <grp.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <map>
#include <set>

#include "tests/apps/program.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

constexpr uid_t kNobody = 65534;

/// Every value that the unit gives a key, in the order of its lines.
std::vector<std::string> of_unit(const std::string& key) {
  std::vector<std::string> all;
  std::ifstream unit(TANDEM_SOURCE_DIR "/scripts/tandem@.service");
  for (std::string line; std::getline(unit, line);) {
    if (!line.starts_with(key + "=")) continue;
    std::istringstream values(line.substr(key.size() + 1));
    for (std::string value; values >> value;) all.push_back(value);
  }
  return all;
}

#define CALL(name) \
  { #name, SYS_##name }
const std::map<std::string, int> kCalls{
    CALL(execve),
    CALL(exit),
    CALL(exit_group),
    CALL(clone),
    CALL(clone3),
    CALL(futex),
    CALL(set_robust_list),
    CALL(set_tid_address),
    CALL(rseq),
    CALL(prctl),
    CALL(restart_syscall),
    CALL(wait4),
    CALL(getpid),
    CALL(gettid),
    CALL(getuid),
    CALL(geteuid),
    CALL(getgid),
    CALL(getegid),
    CALL(uname),
    CALL(sysinfo),
    CALL(prlimit64),
    CALL(getrlimit),
    CALL(getrusage),
    CALL(getrandom),
    CALL(capget),
    CALL(sched_setscheduler),
    CALL(sched_getscheduler),
    CALL(sched_getparam),
    CALL(sched_setaffinity),
    CALL(sched_getaffinity),
    CALL(sched_get_priority_max),
    CALL(sched_get_priority_min),
    CALL(sched_yield),
    CALL(clock_nanosleep),
    CALL(nanosleep),
    CALL(clock_gettime),
    CALL(clock_getres),
    CALL(gettimeofday),
    CALL(brk),
    CALL(mmap),
    CALL(munmap),
    CALL(mprotect),
    CALL(mremap),
    CALL(madvise),
    CALL(mlock),
    CALL(mlockall),
    CALL(munlockall),
    CALL(rt_sigaction),
    CALL(rt_sigprocmask),
    CALL(rt_sigreturn),
    CALL(rt_sigpending),
    CALL(sigaltstack),
    CALL(kill),
    CALL(tgkill),
    CALL(openat),
    CALL(close),
    CALL(read),
    CALL(write),
    CALL(readv),
    CALL(writev),
    CALL(pread64),
    CALL(pwrite64),
    CALL(lseek),
    CALL(fstat),
    CALL(newfstatat),
    CALL(statx),
    CALL(statfs),
    CALL(fstatfs),
    CALL(faccessat),
    CALL(faccessat2),
    CALL(readlinkat),
    CALL(getcwd),
    CALL(getdents64),
    CALL(unlinkat),
    CALL(fchmod),
    CALL(ftruncate),
    CALL(fallocate),
    CALL(fsync),
    CALL(fdatasync),
    CALL(fcntl),
    CALL(flock),
    CALL(ioctl),
    CALL(dup),
    CALL(dup3),
    CALL(pipe2),
    CALL(eventfd2),
    CALL(umask),
    CALL(socket),
    CALL(socketpair),
    CALL(bind),
    CALL(listen),
    CALL(connect),
    CALL(accept),
    CALL(accept4),
    CALL(getsockname),
    CALL(getpeername),
    CALL(getsockopt),
    CALL(setsockopt),
    CALL(sendto),
    CALL(sendmsg),
    CALL(sendmmsg),
    CALL(recvfrom),
    CALL(recvmsg),
    CALL(recvmmsg),
    CALL(shutdown),
    CALL(ppoll),
    CALL(pselect6),
    CALL(epoll_create1),
    CALL(epoll_ctl),
    CALL(epoll_pwait),
    CALL(timerfd_create),
    CALL(timerfd_settime),
#ifdef __x86_64__
    CALL(arch_prctl),
    CALL(open),
    CALL(stat),
    CALL(lstat),
    CALL(access),
    CALL(readlink),
    CALL(mkdir),
    CALL(rmdir),
    CALL(unlink),
    CALL(rename),
    CALL(renameat),
    CALL(chmod),
    CALL(dup2),
    CALL(poll),
    CALL(select),
    CALL(epoll_wait),
#endif
};
#undef CALL

const std::map<std::string, int> kFamilies{{"AF_UNIX", AF_UNIX},
                                           {"AF_CAN", AF_CAN},
                                           {"AF_INET", AF_INET},
                                           {"AF_INET6", AF_INET6},
                                           {"AF_NETLINK", AF_NETLINK}};
const std::map<std::string, int> kCapabilities{{"CAP_SYS_NICE", CAP_SYS_NICE},
                                               {"CAP_IPC_LOCK", CAP_IPC_LOCK}};

/// The numbers of what the unit's key names; an unknown name is a failure.
std::vector<int> numbers(const std::string& key, const std::map<std::string, int>& known) {
  std::vector<int> all;
  for (const std::string& name : of_unit(key)) {
    const auto found = known.find(name);
    if (found == known.end()) {
      ADD_FAILURE() << "scripts/tandem@.service: " << key << " has " << name
                    << ", which this test does not know";
    } else {
      all.push_back(found->second);
    }
  }
  EXPECT_FALSE(all.empty()) << key;
  return all;
}

/// Any other call ends the process (in the unit it fails: here it must not go unnoticed).
std::vector<sock_filter> filter(const std::vector<int>& calls, const std::vector<int>& families) {
  const auto load = [](std::size_t offset) {
    return sock_filter{BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)};
  };
  const auto give = [](std::uint32_t verdict) {
    return sock_filter{BPF_RET | BPF_K, 0, 0, verdict};
  };
  const auto unless = [](int value, std::uint8_t skip) {
    return sock_filter{BPF_JMP | BPF_JEQ | BPF_K, 0, skip, static_cast<std::uint32_t>(value)};
  };
  std::vector<sock_filter> program{load(offsetof(seccomp_data, nr))};
  for (const int call : calls) {
    if (call == SYS_socket) continue;
    program.push_back(unless(call, 1));
    program.push_back(give(SECCOMP_RET_ALLOW));
  }
  program.push_back(unless(SYS_socket, static_cast<std::uint8_t>(2 * families.size() + 1)));
  program.push_back(load(offsetof(seccomp_data, args[0])));
  for (const int family : families) {
    program.push_back(unless(family, 1));
    program.push_back(give(SECCOMP_RET_ALLOW));
  }
  program.push_back(give(SECCOMP_RET_KILL_PROCESS));
  return program;
}

/// What the child makes of itself, and where it failed.
class Rights {
 public:
  Rights(std::vector<int> capabilities, std::vector<sock_filter> calls)
      : capabilities_(std::move(capabilities)), calls_(std::move(calls)) {}

  /// In a child of a test that is root. @return what the machine does not permit; null: nothing
  [[nodiscard]] const char* take() const {
    for (int one = 0; one <= CAP_LAST_CAP; ++one) {
      if (std::ranges::find(capabilities_, one) != capabilities_.end()) continue;
      if (::prctl(PR_CAPBSET_DROP, one) != 0 && errno != EINVAL) return "PR_CAPBSET_DROP";
    }
    if (::prctl(PR_SET_KEEPCAPS, 1) != 0) return "PR_SET_KEEPCAPS";
    if (::setgroups(0, nullptr) != 0 || ::setresgid(kNobody, kNobody, kNobody) != 0 ||
        ::setresuid(kNobody, kNobody, kNobody) != 0) {
      return "another user";
    }
    __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct data[2]{};
    for (const int one : capabilities_) {
      __user_cap_data_struct& word = data[one / 32];
      word.effective |= 1U << (one % 32);
      word.permitted = word.inheritable = word.effective;
    }
    if (::syscall(SYS_capset, &head, data) != 0) return "capset";
    for (const int one : capabilities_) {
      if (::prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, one, 0, 0) != 0) return "ambient set";
    }
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return "NO_NEW_PRIVS";
    return nullptr;
  }
  [[nodiscard]] bool filter_calls() const {
    const sock_fprog program{static_cast<unsigned short>(calls_.size()),
                             const_cast<sock_filter*>(calls_.data())};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
  }

 private:
  std::vector<int> capabilities_;
  std::vector<sock_filter> calls_;
};

class Confined : public Program {
 protected:
  void TearDown() override {
    std::filesystem::remove_all(runtime_);
    Program::TearDown();
  }
  /// A socket's path is short, the build folder's may be long.
  const std::filesystem::path runtime_ =
      "/tmp/tandem-confined-" + std::to_string(::getuid()) + "-" + std::to_string(::getpid());
  Rights rights{
      numbers("CapabilityBoundingSet", kCapabilities),
      filter(numbers("SystemCallFilter", kCalls), numbers("RestrictAddressFamilies", kFamilies))};

  /// Runs a probe in a child with these rights. @return its exit status
  template <class Probe>
  [[nodiscard]] int in_child(Probe probe) const {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(probe());
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  /// Why this machine cannot give a process these rights; empty: it can.
  [[nodiscard]] std::string not_permitted() const {
    if (*TANDEM_SANITIZE != '\0') return "the sanitizer's run-time makes other system calls";
    if (::geteuid() != 0) return test::needs_root("to give a process another user and its rights");
    switch (in_child([this] {
      if (rights.take() != nullptr) return 1;
      const sched_param priority{.sched_priority = 80};
      if (::sched_setscheduler(0, SCHED_FIFO, &priority) != 0) return 2;
      if (::access(TANDEM_BINARY_DIR "/bin/tandem", X_OK) != 0) return 3;
      if (::access((folder_ / "hold.toml").c_str(), R_OK) != 0) return 3;
      return rights.filter_calls() ? 0 : 4;
    })) {
      case 0: return {};
      case 1: return "this machine lets nobody drop capabilities (a container's own filter?)";
      case 2: return "this machine gives no real-time priority, not even with CAP_SYS_NICE";
      case 3: return "another user cannot read the build folder";
      default: return "this kernel has no seccomp filters";
    }
  }
  /// `tandem run hold.toml MORE`, confined.
  [[nodiscard]] pid_t begin(const std::vector<std::string>& more) const {
    std::vector<std::string> words{TANDEM_BINARY_DIR "/bin/tandem", "run", "hold.toml",
                                   "--no-build"};
    words.insert(words.end(), more.begin(), more.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string err = folder_ / "err.txt", out = folder_ / "out.txt";
    const std::string runtime = "XDG_RUNTIME_DIR=" + runtime_.string();
    char* environment[]{const_cast<char*>(runtime.c_str()), nullptr};
    const pid_t child = ::fork();
    if (child != 0) return child;
    const bool ready = ::chdir(folder_.c_str()) == 0 &&
                       ::dup2(::open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644), 1) == 1 &&
                       ::dup2(::open(err.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644), 2) == 2 &&
                       rights.take() == nullptr && rights.filter_calls();
    if (ready) ::execve(arguments[0], arguments.data(), environment);
    ::_exit(99);
  }
  void give_folder() const {
    std::filesystem::create_directory(runtime_);
    for (const auto& one : {folder_, runtime_}) {
      ASSERT_EQ(::chown(one.c_str(), kNobody, kNobody), 0);
    }
  }
  /// The policies of all its threads.
  [[nodiscard]] static std::set<int> policies(pid_t process) {
    std::set<int> all;
    std::error_code gone;
    for (const auto& task :
         std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task", gone)) {
      all.insert(::sched_getscheduler(std::stoi(task.path().filename())));
    }
    return all;
  }
  [[nodiscard]] static long locked_kB(pid_t process) {
    std::istringstream status(read_text("/proc/" + std::to_string(process) + "/status"));
    for (std::string word; status >> word;) {
      if (word == "VmLck:" && status >> word) return std::stol(word);
    }
    return 0;
  }
  [[nodiscard]] static int wait(pid_t process) {
    int status = 0;
    ::waitpid(process, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
};

TEST_F(Confined, ARunEndsInOrderWithRealTimePriorityAndLockedMemory) {
  if (const std::string reason = not_permitted(); !reason.empty()) GTEST_SKIP() << reason;
  give_folder();
  std::ofstream(folder_ / "hold.toml", std::ios::app) << "\n[realtime]\n";  // FIFO, 80, locked
  for (const bool dds : {false, true}) {
    std::vector<std::string> more{"--realtime", "--duration", "2",       "--log",
                                  "logs",       "--json",     "run.json"};
    if (dds) more.insert(more.end(), {"--dds", "--domain", "98"});
    const pid_t run = begin(more);
    EXPECT_TRUE(tandem::test::eventually([&] { return policies(run).contains(SCHED_FIFO); }));
    EXPECT_TRUE(tandem::test::eventually([&] { return locked_kB(run) > 0; }));
    EXPECT_EQ(wait(run), 0) << read_text(folder_ / "err.txt") << read_text(folder_ / "out.txt");
    EXPECT_EQ(read_text(folder_ / "err.txt").find("could not get"), std::string::npos)
        << read_text(folder_ / "err.txt");
    const auto json = nlohmann::json::parse(read_text(folder_ / "run.json"));
    EXPECT_GT(json["log"]["messages"].get<int>(), 1000) << "and its log is there";
    EXPECT_EQ(json["overruns"].is_number(), true);
  }
}

TEST_F(Confined, ARunIsAskedAndStopsBySignal) {
  if (const std::string reason = not_permitted(); !reason.empty()) GTEST_SKIP() << reason;
  give_folder();
  const pid_t run =
      begin({"--realtime", "--duration", "60", "--no-log", "--json", "run.json", "--studio=0"});
  const std::string socket =
      (runtime_ / "tandem" / ("run-" + std::to_string(run) + ".sock")).string();
  EXPECT_TRUE(tandem::test::eventually([&] {
    return this->tandem("ask '{\"do\": \"status\"}' --socket " + socket).out.find("running") !=
           std::string::npos;
  }));
  EXPECT_EQ(this->tandem("ask '{\"do\": \"controller.load\", \"plugin\": \"hold\", \"name\": "
                         "\"other\"}' --socket " +
                         socket)
                .status,
            0);
  ASSERT_EQ(::kill(run, SIGINT), 0);
  EXPECT_EQ(wait(run), 130) << read_text(folder_ / "err.txt");
}

// That the list is a list: what it leaves out ends the process here.
TEST_F(Confined, WhatIsNotListedIsNotPermitted) {
  if (const std::string reason = not_permitted(); !reason.empty()) GTEST_SKIP() << reason;
  const auto ends_by = [this](auto call) {
    return in_child([&] {
      if (rights.take() != nullptr || !rights.filter_calls()) return 98;
      call();
      return 0;
    });
  };
  EXPECT_EQ(ends_by([] { (void)::syscall(SYS_ptrace, 0, 0, 0, 0); }), -SIGSYS);
  EXPECT_EQ(ends_by([] { (void)::socket(AF_PACKET, SOCK_RAW, 0); }), -SIGSYS);
  EXPECT_EQ(ends_by([] { (void)::socket(AF_INET, SOCK_DGRAM, 0); }), 0);
  EXPECT_EQ(ends_by([] { (void)!::setuid(0); }), -SIGSYS);
}

}  // namespace
}  // namespace tandem::apps
