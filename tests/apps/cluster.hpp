// A cluster of one node on this machine: a real munge, slurmctld and slurmd, as this user, in a
// folder and on ports of their own.
// Layer: tests.  Thread: main.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "base/open_file.hpp"
#include "base/process.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {

class Cluster {
 public:
  /// Whether its programs are installed: scripts/packages.txt names their packages.
  static bool installed() {
    for (const char* name : {"munged", "slurmctld", "slurmd", "sbatch", "scancel", "setpriv"})
      if (!program_exists(path_of(name))) return false;
    return true;
  }

  /// @param max_array_size  of the site
  explicit Cluster(int max_array_size) {
    EXPECT_NE(::mkdtemp(folder_.path.data()), nullptr);
    configure(max_array_size);
    ::setenv("SLURM_CONF", (folder_ / "slurm.conf").c_str(), 1);
    ::setenv("TMPDIR", folder_.path.c_str(), 1);  // jobs that are killed leave something there
    munged_ =
        start({"munged", "--foreground", "--force", "--key-file=" + (folder_ / "key"),
               "--socket=" + (folder_ / "munge"), "--log-file=" + (folder_ / "munge.log"),
               "--pid-file=" + (folder_ / "munge.pid"), "--seed-file=" + (folder_ / "munge.seed")});
    EXPECT_TRUE(test::eventually([&] { return std::filesystem::exists(folder_ / "munge"); }));
    controller_ = start({"slurmctld", "-D"});
    start_node();
  }
  ~Cluster() {
    if (controller_ > 0) {
      (void)said("scancel --user=" + std::to_string(::getuid()));
      (void)test::eventually([&] { return queue().empty(); });
    }
    for (pid_t* one : {&node_, &controller_, &munged_}) end(*one, SIGTERM);
    ::unsetenv("SLURM_CONF");
    temporary_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", temporary_.c_str(), 1);
    std::error_code ignored;
    std::filesystem::remove_all(folder_.path, ignored);
  }
  Cluster(const Cluster&) = delete;
  Cluster& operator=(const Cluster&) = delete;

  void start_node() {
    node_ = start({"slurmd", "-D"});
    EXPECT_TRUE(test::eventually([&] { return said("sinfo -h -o %T") == "idle\n"; }))
        << said("sinfo") << read_text(folder_ / "slurmd.txt");
  }
  /// As a node that loses its daemon; what runs goes on.
  void kill_node() { end(node_, SIGKILL); }

  /// What waits and runs, a line each.
  [[nodiscard]] std::string queue() const { return said("squeue -h -r -o '%i %T'"); }

 private:
  /// Daemons are in folders that not every user's $PATH has.
  static std::string path_of(const std::string& name) {
    const std::string system = "/usr/sbin/" + name;
    return program_exists(system) ? system : name;
  }

  void configure(int max_array_size) {
    std::string host(256, '\0');
    (void)::gethostname(host.data(), host.size() - 1);
    host = host.substr(0, host.find_first_of(std::string("\0.", 2)));
    for (const char* name : {"state", "spool"}) std::filesystem::create_directory(folder_ / name);
    write_text(folder_ / "key", std::string(64, 'k') + folder_.path + std::string(64, 'k'));
    (void)::chmod((folder_ / "key").c_str(), 0600);
    const std::vector<std::string> ports = free_ports();
    const std::string user = std::to_string(::getuid());
    write_text(folder_ / "slurm.conf",
               "ClusterName=test\nSlurmctldHost=" + host +
                   "(127.0.0.1)\nSlurmctldPort=" + ports[0] + "\nSlurmdPort=" + ports[1] +
                   "\nSlurmUser=" + user + "\nSlurmdUser=" + user +
                   "\nAuthType=auth/munge\nAuthInfo=socket=" + (folder_ / "munge") +
                   "\nStateSaveLocation=" + (folder_ / "state") + "\nSlurmdSpoolDir=" +
                   (folder_ / "spool") + "\nSlurmctldPidFile=" + (folder_ / "ctld.pid") +
                   "\nSlurmdPidFile=" + (folder_ / "d.pid") +
                   "\nMaxArraySize=" + std::to_string(max_array_size) + "\nNodeName=" + host +
                   " NodeAddr=127.0.0.1 CPUs=2\nPartitionName=all Default=YES Nodes=" + host + R"(
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SchedulerType=sched/builtin
SchedulerParameters=batch_sched_delay=0
ReturnToService=2
MpiDefault=none
KillWait=1
)");
  }

  static std::vector<std::string> free_ports() {
    std::vector<Descriptor> held;
    std::vector<std::string> ports;
    for (int i = 0; i < 2; ++i) {
      held.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      socklen_t size = sizeof address;
      auto* raw = reinterpret_cast<sockaddr*>(&address);
      EXPECT_EQ(::bind(held.back().get(), raw, size), 0);
      EXPECT_EQ(::getsockname(held.back().get(), raw, &size), 0);
      ports.push_back(std::to_string(ntohs(address.sin_port)));
    }
    return ports;
  }

  /// A daemon that ends with this process.
  pid_t start(std::vector<std::string> words) const {
    const std::string name = words.front();
    words.front() = path_of(name);
    words.insert(words.begin(), {"setpriv", "--pdeathsig", "KILL"});
    const auto child =
        spawn({.command = words, .output = folder_ / (name + ".txt"), .own_group = true});
    EXPECT_TRUE(child.has_value()) << name;
    return child.value_or(-1);
  }
  static void end(pid_t& daemon, int signal) {
    if (daemon <= 0) return;
    (void)::kill(daemon, signal);
    (void)wait_for(daemon);
    daemon = -1;
  }

  [[nodiscard]] std::string said(const std::string& command) const {
    (void)!std::system((command + " > '" + (folder_ / "said") + "' 2>&1").c_str());
    return read_text(folder_ / "said");
  }

  /// In /tmp: paths in slurm.conf have no blanks, and sockets' have 107 bytes at most.
  struct Folder {
    std::string path = "/tmp/tandem-slurm-XXXXXX";
    std::string operator/(const std::string& name) const { return path + "/" + name; }
  };
  static std::string environment(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  }
  std::string temporary_ = environment("TMPDIR");
  Folder folder_;
  pid_t munged_ = -1, controller_ = -1, node_ = -1;
};

}  // namespace tandem::apps
