# Compiler settings of every target, and the functions that declare a room, a plugin and a test.

set(CMAKE_CXX_STANDARD 23)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# Its depfiles name headers with the apostrophe as it is, which ninja takes for the end of a name.
if(CMAKE_GENERATOR MATCHES "Ninja" AND PROJECT_BINARY_DIR MATCHES "'")
  message(WARNING "The path ${PROJECT_BINARY_DIR} has an apostrophe: ninja 1.11 builds everything "
    "anew each time. Move the folder, or use ninja of a later version if it does better.")
endif()
find_program(TANDEM_CCACHE ccache)
if(TANDEM_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Sloppy about what a precompiled header is made of, without which ccache refuses to store its users.
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${TANDEM_CCACHE})
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher})
endif()

# A faster linker where there is one; what g++ optimises as a whole needs its own.
find_program(TANDEM_LLD ld.lld)  # which a cross compiler does not look for
if(TANDEM_LLD AND NOT CMAKE_CROSSCOMPILING AND NOT CMAKE_INTERPROCEDURAL_OPTIMIZATION)
  add_link_options(-fuse-ld=lld)
endif()

find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(nlohmann_json REQUIRED)

# Contraction is off so that a run's bits do not depend on the build type. What is silenced for g++
# are its warnings of what std::string does inside (GCC bug 105651).
add_library(tandem_options INTERFACE)
target_compile_features(tandem_options INTERFACE cxx_std_23)
set(TANDEM_STRING_WARNINGS "$<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread>>")
target_compile_options(tandem_options INTERFACE -ffp-contract=off
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wconversion;-Wno-sign-conversion>"
  ${TANDEM_STRING_WARNINGS}
  # Nobody replaces a function of a library here, so that g++ may put one into another with -fPIC.
  "$<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>>"
  # g++ collects its garbage at 128 MB, which costs a twentieth of the time; a source here takes 1 GB.
  "$<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>>")
# Eigen fuses products and sums on 64-bit Arm wherever the processor can, whatever the option says.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64)
  target_compile_options(tandem_options INTERFACE -U__ARM_FEATURE_FMA)
endif()
target_link_options(tandem_options INTERFACE ${TANDEM_STRING_WARNINGS})  # link-time optimisation warns, too
target_include_directories(tandem_options INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
target_link_libraries(tandem_options INTERFACE Threads::Threads)

# The headers that cost most, parsed once for all rooms and plugins. Every source includes what it
# needs all the same: it has to compile with CMAKE_DISABLE_PRECOMPILE_HEADERS as well.
set(TANDEM_COSTLY_HEADERS <algorithm> <array> <chrono> <cmath> <filesystem> <functional> <map> <memory>
  <optional> <span> <string> <thread> <vector> <Eigen/Dense> <nlohmann/json.hpp>)
add_library(tandem_pch STATIC ${CMAKE_CURRENT_LIST_DIR}/pch.cpp)
target_link_libraries(tandem_pch PRIVATE tandem_options Eigen3::Eigen nlohmann_json::nlohmann_json)
target_precompile_headers(tandem_pch PRIVATE ${TANDEM_COSTLY_HEADERS})

# One of clang's or gcc's sanitizers over everything, as the presets rtsan, asan and tsan choose. What
# RealtimeSanitizer says is in the names of functions; lines would cost a sixth of its build.
set(TANDEM_SANITIZE "" CACHE STRING "Value of -fsanitize=, such as address,undefined")
if(TANDEM_SANITIZE)
  set(lines -g1)
  if(TANDEM_SANITIZE STREQUAL "realtime")
    set(lines)
  endif()
  target_compile_options(tandem_options INTERFACE
    -fsanitize=${TANDEM_SANITIZE} -fno-omit-frame-pointer ${lines})
  target_link_options(tandem_options INTERFACE -fsanitize=${TANDEM_SANITIZE})
endif()

# scripts/build-robot sets it: first "record", so that runs leave beside the objects how often each
# branch was taken, then "use". What no run came to is optimised as it is without a profile.
set(TANDEM_PROFILE "" CACHE STRING "g++: record a profile of what runs, or use one")
set_property(CACHE TANDEM_PROFILE PROPERTY STRINGS "" record use)
if(TANDEM_PROFILE AND NOT CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  message(FATAL_ERROR "TANDEM_PROFILE is for g++ (leave it empty, or set CMAKE_CXX_COMPILER=g++)")
elseif(TANDEM_PROFILE STREQUAL record)
  set(TANDEM_PROFILE_OPTIONS -fprofile-generate -fprofile-update=prefer-atomic)
elseif(TANDEM_PROFILE STREQUAL use)
  set(TANDEM_PROFILE_OPTIONS -fprofile-use -fprofile-partial-training -Wno-missing-profile
    -Wno-error=coverage-mismatch)
elseif(TANDEM_PROFILE)
  message(FATAL_ERROR "TANDEM_PROFILE is '${TANDEM_PROFILE}' (leave it empty, or say record or use)")
endif()
target_compile_options(tandem_options INTERFACE "$<BUILD_INTERFACE:${TANDEM_PROFILE_OPTIONS}>")
target_link_options(tandem_options INTERFACE "$<BUILD_INTERFACE:${TANDEM_PROFILE_OPTIONS}>")

# tandem_room(NAME SOURCES … LINKS …): the static library tandem_NAME of one folder.
function(tandem_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;LINKS" ${ARGN})
  add_library(tandem_${name} STATIC ${ROOM_SOURCES})
  target_link_libraries(tandem_${name} PUBLIC tandem_options ${ROOM_LINKS})
  target_precompile_headers(tandem_${name} REUSE_FROM tandem_pch)
endfunction()

include(TandemController)

# tandem_kernels(ROBOT TOML): the target kernels_ROBOT makes lib/models/ROBOT_kernels.so by `tandem
# model build`. The builder skips what is up to date, so the target always runs and mostly does
# nothing. One at a time: each uses every core for its compilers.
# A sanitizer's build takes those of another build folder, when they are there: they are the same.
set(TANDEM_MODELS_FROM "" CACHE PATH "Build folder whose kernel libraries are used")
set_property(GLOBAL APPEND PROPERTY JOB_POOLS kernels=1)
function(tandem_kernels robot toml)
  set(library lib/models/${robot}_kernels.so)
  if(TANDEM_MODELS_FROM AND EXISTS ${TANDEM_MODELS_FROM}/${library})
    add_custom_target(kernels_${robot}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/lib/models
      COMMAND ${CMAKE_COMMAND} -E create_symlink ${TANDEM_MODELS_FROM}/${library}
        ${PROJECT_BINARY_DIR}/${library}
      VERBATIM)
    return()
  endif()
  add_custom_target(kernels_${robot}
    COMMAND tandem-tools model build ${toml} -o ${PROJECT_BINARY_DIR}/${library}
    JOB_POOL kernels VERBATIM
    COMMENT "Kernels of ${robot}")
endfunction()

# tandem_test_program(NAME SOURCES … LINKS …): one GoogleTest executable. The target `tests`
# builds them all.
function(tandem_test_program name)
  cmake_parse_arguments(TEST "" "" "SOURCES;LINKS" ${ARGN})
  add_executable(${name} ${TEST_SOURCES})
  add_dependencies(tests ${name})
  target_link_libraries(${name} PRIVATE ${TEST_LINKS} GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-${TANDEM_TEST_OPTIMISATION}>)
  target_precompile_headers(${name} REUSE_FROM tandem_test_pch_${TANDEM_TEST_OPTIMISATION})
  target_compile_definitions(${name} PRIVATE TANDEM_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    TANDEM_BINARY_DIR="${PROJECT_BINARY_DIR}")
endfunction()

# tandem_test(NAME SOURCES … LINKS … [LABEL unit|sim|rt] [WAITS] [OFF_CYCLE]): a test program each
# of whose cases is a ctest of its own. WAITS: some of its cases mostly wait, and long: ctest starts
# them first, and beside them those that compute. (Once it has run, it knows by itself what takes
# long.) OFF_CYCLE: nothing that it calls runs in the cycle, and RealtimeSanitizer would see nothing.
function(tandem_test name)
  cmake_parse_arguments(TEST "WAITS;OFF_CYCLE" "LABEL" "SOURCES;LINKS" ${ARGN})
  if(TEST_OFF_CYCLE AND TANDEM_SANITIZE STREQUAL "realtime")
    add_custom_target(${name})  # for add_dependencies()
    return()
  endif()
  if(NOT TEST_LABEL)
    set(TEST_LABEL unit)
  endif()
  set(cost)
  if(TEST_WAITS)
    set(cost COST 10)
  endif()
  tandem_test_program(${name} SOURCES ${TEST_SOURCES} LINKS ${TEST_LINKS})
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST
    PROPERTIES LABELS ${TEST_LABEL} TIMEOUT 300 ${cost}
      ENVIRONMENT_MODIFICATION ROS_DOMAIN_ID=unset:)
endfunction()
