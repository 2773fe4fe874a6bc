#include "controllers/plugin_loader.hpp"

#include <dlfcn.h>

#include <filesystem>
#include <fstream>

#include "base/quoting.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem {
namespace {

const std::vector<std::string> kBroken{std::string(TANDEM_BINARY_DIR) + "/tests/broken_plugins"};

TEST(PluginLoader, OpensABundledControllerByItsName) {
  const auto loaded = load_controller("hold", test::bundled_folder());
  ASSERT_TRUE(loaded.has_value()) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().name, "hold");
  EXPECT_EQ(loaded->path(), test::bundled_folder()[0] + "/hold.so");
}

TEST(PluginLoader, OpensALibraryByItsPath) {
  EXPECT_TRUE(load_controller(test::bundled_folder()[0] + "/hold.so", {}).has_value());
}

TEST(PluginLoader, NamesTheFoldersSearchedAndTheNearestController) {
  const auto loaded = load_controller("hodl", test::bundled_folder());
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().message, "no such controller in " + test::bundled_folder()[0]);
  EXPECT_EQ(
      loaded.error().hint,
      "did you mean 'hold'?; list your own folders in TANDEM_CONTROLLERS, or name the library "
      "by a path with a '/'");
}

TEST(PluginLoader, SaysHowABundledControllerIsBuilt) {
  const auto loaded = load_controller("squat", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().hint, "build it: cmake --build " + shell_word(TANDEM_BINARY_DIR) +
                                     " --target controller_squat");
}

TEST(PluginLoader, NamesAPathThatDoesNotExist) {
  const auto loaded = load_controller("no/such.so", {});
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().file, "no/such.so");
}

/// A library in the place of `file`, as a linker puts it there.
void put_library(const std::string& library, const std::string& file) {
  std::filesystem::copy_file(kBroken[0] + "/" + library, file + ".new");
  std::filesystem::rename(file + ".new", file);
}
/// A build of tests/controllers/plugins/renewed.cpp.
void put(const std::string& build, const std::string& file) {
  put_library("renewed_" + build + ".so", file);
}
bool stays_mapped(const std::string& file) {
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_NOLOAD);
  if (library != nullptr) dlclose(library);
  return library != nullptr;
}

#ifdef __clang__
constexpr bool kMakesUniqueSymbols = false;
#else
constexpr bool kMakesUniqueSymbols = true;
#endif
const char* const kNoUniqueSymbols = "clang makes no symbol that is one for the process";

// "done", and the former code ran: a symbol that is one for the process keeps a library mapped.
TEST(PluginLoader, OpensTheNewBuildOfALibraryThatIsStillMapped) {
  if (!kMakesUniqueSymbols) GTEST_SKIP() << kNoUniqueSymbols;
  const test::ScratchFolder folder;
  const std::string file = folder / "renewed.so";
  put("1", file);
  EXPECT_STREQ(load_controller(file, {})->plugin().doc, "Build 1.");
  ASSERT_TRUE(stays_mapped(file)) << "else this shows nothing";
  for (const std::string build : {"2", "1", "2"}) {
    put(build, file);
    const auto loaded = load_controller(file, {});
    ASSERT_TRUE(loaded) << loaded.error().to_string();
    EXPECT_EQ(loaded->plugin().doc, "Build " + build + ".");
    EXPECT_EQ(loaded->path(), file);
    EXPECT_EQ(load_controller(file, {})->plugin().doc, "Build " + build + ".") << "unchanged";
  }
}

TEST(PluginLoader, OpensTheNewBuildBesideAControllerOfTheFormerOne) {
  const test::ScratchFolder folder;
  const std::string file = folder / "mine.so";
  std::filesystem::copy_file(test::bundled_folder()[0] + "/hold.so", file);
  const auto former = load_controller(file, {});
  ASSERT_TRUE(former);
  put("1", file);
  const auto loaded = load_controller(file, {});
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().name, "renewed");
  EXPECT_STREQ(former->plugin().name, "hold");
}

// Its new code would run with the variables of the former one.
TEST(PluginLoader, RefusesTheNewBuildOfALibraryWhoseOwnVariablesStay) {
  if (!kMakesUniqueSymbols) GTEST_SKIP() << kNoUniqueSymbols;
  const test::ScratchFolder folder;
  const std::string file = folder / "renewed.so";
  put("own_1", file);
  EXPECT_STREQ(load_controller(file, {})->plugin().doc, "Build 1.");
  put("own_2", file);
  const auto loaded = load_controller(file, {});
  ASSERT_FALSE(loaded);
  EXPECT_NE(loaded.error().message.find("would use its variable build_of_this"), std::string::npos)
      << loaded.error().message;
  put("1", file);
  EXPECT_TRUE(load_controller(file, {})) << "has none";
}

// A name of its own with a type of std in it was taken for one of std, and so was the table by
// which std::visit() calls the controller's code: the new build ran with the former one's.
TEST(PluginLoader, RefusesTheNewBuildOfALibraryWhoseVariablesOnlyLookLikeThoseOfStd) {
  if (!kMakesUniqueSymbols) GTEST_SKIP() << kNoUniqueSymbols;
  for (const std::string kind : {"named", "table"}) {
    const test::ScratchFolder folder;
    const std::string file = folder / "renewed.so";
    put(kind + "_1", file);
    EXPECT_STREQ(load_controller(file, {})->plugin().doc, "Build 1.");
    put(kind + "_2", file);
    const auto loaded = load_controller(file, {});
    ASSERT_FALSE(loaded) << kind;
    const std::string variable = kind == "named" ? "use its variable Build<" : "_S_vtable";
    EXPECT_NE(loaded.error().message.find(variable), std::string::npos) << loaded.error().message;
    EXPECT_NE(loaded.error().hint.find("-fno-gnu-unique"), std::string::npos);
  }
}

// One that finds another library beside itself was taken for the former one, by its name.
TEST(PluginLoader, OpensTheNewBuildOfALibraryThatLooksBesideItself) {
  const test::ScratchFolder folder;
  const std::string file = folder / "renewed.so";
  put_library("needed_1/librenewed_needed.so", folder / "librenewed_needed.so");
  put("needed_1", file);
  const auto former = load_controller(file, {});
  ASSERT_TRUE(former) << former.error().to_string();
  put("needed_2", file);
  const auto loaded = load_controller(file, {});
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_NE(&loaded->plugin(), &former->plugin());
}

// The linker takes what has the same name and is mapped: the new code called the former library.
TEST(PluginLoader, RefusesALibraryOneOfWhoseNeedsStaysAsItWas) {
  const test::ScratchFolder folder;
  const std::string file = folder / "renewed.so", needed = folder / "librenewed_needed.so";
  put_library("needed_1/librenewed_needed.so", needed);
  put("needed_1", file);
  auto former = load_controller(file, {});
  ASSERT_TRUE(former) << former.error().to_string();
  EXPECT_STREQ(former->plugin().doc, "Build 1.");
  put_library("needed_2/librenewed_needed.so", needed);
  put("needed_2", file);
  const auto refused = load_controller(file, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "needs " + std::filesystem::canonical(needed).string() +
                                         ", which was built anew while its former code is in this "
                                         "process");
  former = fail("it is unloaded");
  const auto loaded = load_controller(file, {});
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().doc, "Build 2.");
}

// By tandem_add_controller() nothing is exported but the entry point, and so all of it is freed.
TEST(PluginLoader, FreesABundledLibraryWithItsLastController) {
  for (const std::string& name : available_controllers(test::bundled_folder())) {
    ASSERT_TRUE(load_controller(name, test::bundled_folder())) << name;
    EXPECT_FALSE(stays_mapped(test::bundled_folder()[0] + "/" + name + ".so")) << name;
  }
}

// While it is copied, or after a full disk: the loader would map what is not there, and the first
// touch of it end the process.
TEST(PluginLoader, RefusesALibraryThatIsCut) {
  const test::ScratchFolder folder;
  std::ifstream in(test::bundled_folder()[0] + "/hold.so", std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  // Cuts in what is loaded: behind it a library may have much that is not, such as its debugger's.
  for (const std::size_t size : {0U, 100U, 2'000U, 20'000U, 60'000U}) {
    const std::string file = folder / ("cut" + std::to_string(size) + ".so");
    std::ofstream(file, std::ios::binary) << whole.substr(0, size);
    const auto loaded = load_controller(file, {});
    ASSERT_FALSE(loaded.has_value()) << size;
    const std::string text = loaded.error().to_string();
    EXPECT_NE(text.find(size < 64 ? "is no shared library" : "is cut"), std::string::npos)
        << size << ": " << text;
  }
  std::string odd = whole;
  odd.replace(32, 8, "\xff\xff\xff\xff\xff\xff\xff\x7f");  // where its parts are listed
  std::ofstream(folder / "odd.so", std::ios::binary) << odd;
  EXPECT_FALSE(load_controller(folder / "odd.so", {}).has_value());
}

TEST(PluginLoader, RefusesALibraryWithoutItsEntryPoint) {
  const auto loaded = load_controller("no_entry", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().message, "has no entry point tandem_controller_plugin()");
}

TEST(PluginLoader, RefusesALibraryOfOlderHeaders) {
  const auto loaded = load_controller("older_interface", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().message,
            "was built for controller interface " + std::to_string(kControllerInterface - 1) +
                ", this program has " + std::to_string(kControllerInterface));
}

// What a joint is has changed, and nobody has raised the version.
TEST(PluginLoader, RefusesALibraryOfOtherHeadersOfThisVersion) {
  const auto loaded = load_controller("other_layout", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().message, "was built with other headers of controller interface " +
                                        std::to_string(kControllerInterface));
}

// A robot's wiring is its own affair: a controller built before it had one more key still loads.
TEST(PluginLoader, TakesALibraryOfHeadersInWhichOnlyTheWiringDiffers) {
  const auto loaded = load_controller("other_wiring", kBroken);
  ASSERT_TRUE(loaded.has_value()) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().name, "sway");
}

// Whether a joint slides stands in a byte that was padding: no other member has moved.
TEST(PluginLoader, TakesALibraryOfHeadersInWhichNoJointSaysWhetherItSlides) {
  const auto loaded = load_controller("before_slides", kBroken);
  ASSERT_TRUE(loaded.has_value()) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().name, "sway");
}

TEST(PluginLoader, RefusesALibraryOfAnotherCompiler) {
  const auto loaded = load_controller("other_compiler", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_NE(loaded.error().message.find("another age"), std::string::npos);
}

// A create() that returned null was the end of a run that had loaded it, by SIGSEGV.
TEST(PluginLoader, RefusesALibraryThatLeavesSomethingNull) {
  const std::pair<const char*, const char*> kinds[]{
      {"null_plugin", "its entry point tandem_controller_plugin() returns null"},
      {"null_name", "its entry point leaves `name` null"},
      {"null_doc", "its entry point leaves `doc` null"},
      {"null_create", "its entry point leaves `create` null"},
      {"null_controller", "its create() returns no controller (null)"}};
  for (const auto& [name, message] : kinds) {
    const auto loaded = load_controller(name, kBroken);
    ASSERT_FALSE(loaded.has_value()) << name;
    EXPECT_EQ(loaded.error().message, message);
  }
}

TEST(PluginLoader, RefusesAFileThatIsNoLibrary) {
  const test::ScratchFolder folder;
  std::ofstream(folder / "text.so") << "this is no library";
  const auto loaded = load_controller("text", {folder.path()});
  ASSERT_FALSE(loaded.has_value());
  EXPECT_TRUE(loaded.error().message.starts_with("cannot be loaded")) << loaded.error().message;
}

TEST(PluginLoader, LooksIntoTheEnvironmentsFoldersFirst) {
  setenv("TANDEM_CONTROLLERS", "/first:/second", 1);
  const std::vector<std::string> folders = controller_folders();
  unsetenv("TANDEM_CONTROLLERS");
  ASSERT_EQ(folders.size(), 4U);
  EXPECT_EQ(folders[0], "/first");
  EXPECT_EQ(folders[1], "/second");
  EXPECT_TRUE(folders[2].ends_with("/lib/controllers")) << folders[2];
}

TEST(PluginLoader, TurnsWhatALibraryThrowsIntoAnError) {
  const auto loaded = load_controller("throws_when_made", kBroken);
  ASSERT_FALSE(loaded.has_value());
  EXPECT_EQ(loaded.error().to_string(),
            "throws_when_made: the controller threw an exception: no such thing (a controller "
            "returns its errors; correct it)");
}

/// A library that called exit(0) had ended `tandem check` with success.
TEST(PluginLoader, DoesNotLetALibraryEndTheProcessAsIfAllWereWell) {
  EXPECT_EXIT((void)load_controller("exits_when_made", kBroken), testing::ExitedWithCode(2),
              "error: exits_when_made: the controller ended the process with exit\\(\\)");
}

}  // namespace
}  // namespace tandem
