// Stamps say which objects are up to date; stale ones are compiled in parallel, the library is
// linked, checked by kernel_check and then renamed into place.
#include "model/kernel_build.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <thread>

#include "base/open_file.hpp"
#include "base/process.hpp"
#include "base/sha256.hpp"
#include "base/trusted_code.hpp"
#include "model/file_lock.hpp"
#include "model/kernel_check.hpp"
#include "model/kernel_sources.hpp"

namespace tandem::model {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFreshLibrary = "library.so";  // linked, but not yet checked
constexpr const char* kLock = "lock";

struct Variant {
  std::string name;   // "x86-64-v3"
  std::string space;  // its C++ namespace
  std::vector<std::string> flags;
};

std::vector<Variant> variants() {
  std::vector<Variant> list{{"baseline", "baseline", {"-ffp-contract=off"}}};
#if defined(__x86_64__)
  // v4 is for its 32 registers: 10 to 20 % faster than v3, vectors stay at 256 bits.
  list.push_back({"x86-64-v3", "x86_64_v3", {"-march=x86-64-v3", "-ffp-contract=fast"}});
  list.push_back({"x86-64-v4",
                  "x86_64_v4",
                  {"-march=x86-64-v4", "-mprefer-vector-width=256", "-ffp-contract=fast"}});
#endif
  return list;
}

/// Runs a compiler's `command` in `directory`, what it says to the file `log` there. What fails
/// with the launcher runs again without: ccache fails where it has no folder to write to.
bool succeeds(const std::vector<std::string>& command, const fs::path& directory,
              const std::string& log) {
  const Result<pid_t> child = spawn(
      {.command = command, .output = (directory / log).string(), .directory = directory.string()});
  if (child && wait_for(*child) == 0) return true;
  return command.front() == kDefaultLauncher &&
         succeeds({command.begin() + 1, command.end()}, directory, log);
}

// One file to compile.
struct Job {
  std::string source;
  std::string object;
  std::vector<std::string> command;
  std::string stamp;  // hash of all that the object depends on
};

/// Empty, too, when it cannot be read.
std::string content_of(const fs::path& path) {
  return read_file(path.string(), {}, kMostOtherBytes).value_or("");
}

/// The stamp that an object has when it is up to date: it names the object's bytes, too. After a
/// crash of the machine an object may be empty, and its stamp whole.
std::string stamp_of(const Job& job, const fs::path& directory) {
  return job.stamp + " " + sha256(content_of(directory / job.object));
}

Status write_if_changed(const fs::path& path, const std::string& text) {
  if (fs::exists(path) && content_of(path) == text) return {};
  const Result<Descriptor> file = open_output(path.string());
  if (file && write_all(*file, text) == 0) return {};
  return fail("cannot write " + path.string(), "check the folder's permissions and free space");
}

std::vector<std::string> compiler_command(const BuildOptions& options) {
  std::vector<std::string> command;
  if (!kDefaultLauncher.empty() && program_exists(std::string(kDefaultLauncher)))
    command.emplace_back(kDefaultLauncher);
  const std::string built_with(kDefaultCompiler);
  if (!options.compiler.empty()) {
    command.push_back(options.compiler);
  } else {
    command.push_back(program_exists(built_with) ? built_with : "c++");
  }
  return command;
}

Job make_job(const SourceFile& source, const Variant* variant, const std::string& headers,
             const std::vector<std::string>& compiler) {
  Job job;
  job.source = source.name;
  job.object = fs::path(source.name).stem().string() + (variant ? "_" + variant->space : "") + ".o";
  job.command = compiler;
  // The sources hold the vectors that pay: what gcc makes of scalars beside them costs 2 to 3 %.
  for (const char* flag : {"-std=c++17", source.light ? "-O1" : "-O2", "-frename-registers",
                           "-fno-tree-slp-vectorize", "-fPIC", "-fvisibility=hidden", "-w"})
    job.command.emplace_back(flag);
  // At -O1 gcc fuses no multiplication with an addition without it.
  if (source.light) job.command.emplace_back("-fexpensive-optimizations");
  if (variant != nullptr) {
    job.command.insert(job.command.end(), variant->flags.begin(), variant->flags.end());
    job.command.push_back("-DTANDEM_VARIANT=" + variant->space);
    job.command.push_back("-DTANDEM_VARIANT_NAME=\"" + variant->name + "\"");
  } else if (variants().size() > 1) {
    job.command.emplace_back("-DTANDEM_X86_64");
  }
  for (const std::string& word : {std::string("-c"), job.source, std::string("-o"), job.object})
    job.command.push_back(word);
  std::string all = headers + source.text;
  for (const std::string& word : job.command) all += word + '\0';
  job.stamp = sha256(all);
  return job;
}

std::vector<Job> make_jobs(const GeneratedKernels& generated,
                           const std::vector<std::string>& compiler) {
  std::string headers;
  for (const SourceFile& header : generated.headers) headers += header.text;
  std::vector<Job> jobs;
  const std::vector<Variant> all = variants();
  for (const SourceFile& source : generated.sources) {
    if (!source.per_variant) jobs.push_back(make_job(source, nullptr, headers, compiler));
    for (const Variant& variant : all)
      if (source.per_variant) jobs.push_back(make_job(source, &variant, headers, compiler));
  }
  return jobs;
}

Error compile_error(const fs::path& directory, const std::string& what) {
  const fs::path log = directory / (what + ".log");
  std::string text = content_of(log);
  if (text.size() > 400) text = text.substr(0, 400) + "…";
  Error error;
  error.message = "compiling the kernels failed at " + what + ": " + text;
  error.hint = "the compiler's whole output is in " + log.string();
  error.file = log.string();
  return error;
}

// Compiles `jobs`, some at a time. The progress callback runs on the calling thread.
Status compile(const std::vector<Job>& jobs, const fs::path& directory,
               const BuildOptions& options) {
  const int hardware = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int wanted = options.jobs > 0 ? options.jobs : hardware;
  const int workers = std::min(wanted, static_cast<int>(jobs.size()));
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::size_t> done;
  std::size_t failed = jobs.size();
  const auto work = [&] {
    for (std::size_t i = next++; i < jobs.size(); i = next++) {
      const Job& job = jobs[i];
      const bool ok =
          succeeds(job.command, directory, job.object + ".log") &&
          write_if_changed(directory / (job.object + ".stamp"), stamp_of(job, directory));
      const std::lock_guard lock(mutex);
      if (!ok) {
        failed = std::min(failed, i);
        next = jobs.size();
      }
      done.push_back(i);
      changed.notify_one();
    }
    const std::lock_guard lock(mutex);
    done.push_back(jobs.size());  // this worker is through
    changed.notify_one();
  };
  std::vector<std::jthread> threads;
  for (int i = 0; i < workers; ++i) threads.emplace_back(work);
  int finished = 0;
  int through = 0;
  std::unique_lock lock(mutex);
  for (std::size_t seen = 0; through < workers; ++seen) {
    changed.wait(lock, [&] { return done.size() > seen; });
    if (done[seen] == jobs.size()) {
      ++through;
    } else if (options.progress) {
      options.progress(++finished, static_cast<int>(jobs.size()) + 1, jobs[done[seen]].object);
    }
  }
  if (failed < jobs.size()) return std::unexpected(compile_error(directory, jobs[failed].object));
  return {};
}

// Writes the sources and compiles what is not up to date: how many files.
Result<int> compile_stale(const GeneratedKernels& generated, const std::vector<Job>& jobs,
                          const fs::path& directory, const BuildOptions& options) {
  for (const auto* files : {&generated.headers, &generated.sources})
    for (const SourceFile& file : *files)
      if (Status status = write_if_changed(directory / file.name, file.text); !status)
        return std::unexpected(status.error());
  std::vector<Job> stale;
  for (const Job& job : jobs)
    if (content_of(directory / (job.object + ".stamp")) != stamp_of(job, directory))
      stale.push_back(job);
  if (Status status = compile(stale, directory, options); !status)
    return std::unexpected(status.error());
  return static_cast<int>(stale.size());
}

Status link(const std::vector<Job>& jobs, const std::vector<std::string>& compiler,
            const fs::path& directory) {
  std::vector<std::string> command = compiler;
  for (const char* word : {"-shared", "-o", kFreshLibrary}) command.emplace_back(word);
  for (const Job& job : jobs) command.push_back(job.object);
  if (!succeeds(command, directory, "link.log")) {
    return std::unexpected(compile_error(directory, "link"));
  }
  return seal_library((directory / kFreshLibrary).string());
}

// Renamed, not written: a program that runs keeps the old one.
Status put_in_place(const fs::path& directory, const fs::path& library, const std::string& stamp) {
  std::error_code code;
  fs::rename(directory / kFreshLibrary, library, code);
  if (code) return fail("cannot write " + library.string() + ": " + code.message());
  return write_if_changed(directory / "library.stamp", stamp);
}

// A library that can be loaded.
bool is_whole(const std::string& library) {
  const Result<TrustedCode> code = TrustedCode::open(library);
  return code && code->check_seal();
}

// What is made meanwhile, by compilers, too, is for no group to change.
class OwnFiles {
 public:
  OwnFiles() : before_(::umask(0022)) { ::umask(before_ | 0022); }
  ~OwnFiles() { ::umask(before_); }
  OwnFiles(const OwnFiles&) = delete;
  OwnFiles& operator=(const OwnFiles&) = delete;

 private:
  mode_t before_;
};

// What was compiled before; the lock stays.
void forget_objects(const fs::path& directory) {
  std::error_code ignored;  // what cannot be removed is found out by writing it
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored)) {
    if (entry.path().filename() != kLock) fs::remove(entry.path(), ignored);
  }
}

}  // namespace

std::string library_path(const std::string& directory, const std::string& robot) {
  return (fs::path(directory) / (robot + "_kernels.so")).string();
}

Result<BuildReport> build_kernels(const Tree& tree, const ModelSpec& spec,
                                  const BuildOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const OwnFiles only_ours;
  const Result<GeneratedKernels> generated = generate_kernels(tree, spec);
  if (!generated) return std::unexpected(generated.error());
  const fs::path library = fs::absolute(options.library);
  const fs::path directory = library.string() + ".build";
  std::error_code code;
  fs::create_directories(directory, code);
  if (code)
    return fail("cannot make the folder " + directory.string() + ": " + code.message(),
                "choose another path for the kernel library");
  // What is compiled here is linked from here: nobody else may exchange it meanwhile.
  if (Status ours = check_trusted_folder(directory.string()); !ours)
    return std::unexpected(ours.error());
  const std::vector<std::string> compiler = compiler_command(options);
  if (!program_exists(compiler.back()))
    return fail("no C++ compiler '" + compiler.back() + "'", "install one: apt install g++");
  const Result<FileLock> lock = FileLock::take((directory / kLock).string(), options.waiting);
  if (!lock) return std::unexpected(lock.error());
  if (options.force) forget_objects(directory);

  BuildReport report{options.library, generated->hash, false, 0, 0.0, generated->counts};
  const std::vector<Job> jobs = make_jobs(*generated, compiler);
  std::string all;
  for (const Job& job : jobs) all += job.stamp;
  const std::string stamp = sha256(all);
  if (content_of(directory / "library.stamp") == stamp && is_whole(library.string())) {
    report.was_up_to_date = true;
    return report;
  }
  const Result<int> compiled = compile_stale(*generated, jobs, directory, options);
  if (!compiled) return std::unexpected(compiled.error());
  if (Status status = link(jobs, compiler, directory); !status)
    return std::unexpected(status.error());
  if (Status status = check_kernels((directory / kFreshLibrary).string(), tree, spec); !status)
    return std::unexpected(status.error());
  if (Status status = put_in_place(directory, library, stamp); !status)
    return std::unexpected(status.error());
  report.compiled = *compiled;
  if (options.progress) options.progress(*compiled + 1, *compiled + 1, library.filename().string());
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace tandem::model
