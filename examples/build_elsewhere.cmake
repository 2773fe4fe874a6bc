# Installs into WORK, builds the examples 02, 03, 06 and 08 against that, as they are installed, and 03 as
# a copy in a folder with a blank, and lets the installed program run all on an installed robot.
# Every link of the installed pages leads somewhere. Nothing sets the build type.
# The Python module runs one, too, where it is built.
# -DBUILD=… -DWORK=… -DCOMPILER=… -DPAGES_TEST=… -DPYTHON=…, empty without the module
file(REMOVE_RECURSE ${WORK})
set(prefix ${WORK}/prefix)
set(strange "${WORK}/a strange folder")
# By components: an installation as root leaves a list of files in BUILD, which has another name.
foreach(component program robots dev python)
  execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} --component ${component}
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()
set(ENV{TANDEM_PAGES} ${prefix}/share/doc/tandem)
execute_process(COMMAND ${PAGES_TEST} --gtest_filter=Documentation.Links* COMMAND_ERROR_IS_FATAL ANY)
unset(ENV{TANDEM_PAGES})

# All headers that it lays down, and what those for plugins and readers of logs include.
file(GLOB_RECURSE installed RELATIVE ${prefix}/include/tandem ${prefix}/include/*)
set(wanted controllers/controller.hpp hal/devices.hpp log/log_file.hpp)
foreach(header IN LISTS installed)
  file(STRINGS ${prefix}/include/tandem/${header} lines REGEX "#include \"")
  foreach(line IN LISTS lines)
    string(REGEX REPLACE ".*\"(.*)\".*" "\\1" included "${line}")
    list(APPEND wanted ${included})
  endforeach()
endforeach()
list(REMOVE_DUPLICATES wanted)
list(SORT wanted)
list(SORT installed)
if(NOT wanted STREQUAL installed)
  message(FATAL_ERROR "installed headers: ${installed}\nthat these include: ${wanted}")
endif()

function(build from to)
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${from} -B ${to} -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${COMPILER} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${CMAKE_COMMAND} --build ${to} --verbose OUTPUT_VARIABLE built
    COMMAND_ERROR_IS_FATAL ANY)
  if(NOT built MATCHES " -O[23] ")
    message(FATAL_ERROR "a controller is built without optimisation: ${built}")
  endif()
endfunction()

# What the terminal's own programs find: the manual, and completion.
foreach(file man/man1/tandem.1 man/man1/tandem-run.1 bash-completion/completions/tandem
    zsh/site-functions/_tandem fish/vendor_completions.d/tandem.fish doc/tandem/scripts/tandem@.service)
  if(NOT EXISTS ${prefix}/share/${file})
    message(FATAL_ERROR "not installed: share/${file}")
  endif()
endforeach()
# By name, far from any folder config/.
execute_process(COMMAND ${prefix}/bin/tandem check double_pendulum/hold WORKING_DIRECTORY ${WORK}
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${prefix}/bin/tandem __complete run double_pendulum/ho WORKING_DIRECTORY ${WORK}
  OUTPUT_VARIABLE offered COMMAND_ERROR_IS_FATAL ANY)
if(NOT offered MATCHES "^double_pendulum/hold\tbundled\n")
  message(FATAL_ERROR "completion offers: ${offered}")
endif()
set(example ${prefix}/share/doc/tandem/examples/03_controller)
build(${example} ${WORK}/in_place)
set(ENV{TANDEM_CONTROLLERS} ${WORK}/in_place/lib/controllers)
execute_process(COMMAND ${prefix}/bin/tandem run --no-log --duration 2 --quiet ${example}/sway.toml
  COMMAND_ERROR_IS_FATAL ANY)

set(devices ${prefix}/share/doc/tandem/examples/06_devices)
build(${devices} ${WORK}/devices)
set(ENV{TANDEM_CONTROLLERS} ${WORK}/devices/lib/controllers)
execute_process(COMMAND ${prefix}/bin/tandem run --no-log --duration 2 --quiet ${devices}/reach.toml
  COMMAND_ERROR_IS_FATAL ANY)

set(declarations ${prefix}/share/doc/tandem/examples/08_declarations)
build(${declarations} ${WORK}/declarations)
set(ENV{TANDEM_CONTROLLERS} ${WORK}/declarations/lib/controllers)
execute_process(COMMAND ${prefix}/bin/tandem run --no-log --duration 2 --quiet ${declarations}/nod.toml
  COMMAND_ERROR_IS_FATAL ANY)

# The reader of logs, on a log of the installed program.
file(WRITE ${WORK}/reader/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(reader LANGUAGES CXX)
find_package(tandem REQUIRED COMPONENTS log)
add_executable(read_log \"${prefix}/share/doc/tandem/examples/02_read_log.cpp\")
target_link_libraries(read_log tandem::log)
")
build(${WORK}/reader ${WORK}/reader/build)
execute_process(COMMAND ${prefix}/bin/tandem run double_pendulum/hold --duration 0.5 --quiet --log ${WORK}/logs
  WORKING_DIRECTORY ${WORK} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB log ${WORK}/logs/*.mcap)
execute_process(COMMAND ${WORK}/reader/build/read_log ${log} OUTPUT_VARIABLE read COMMAND_ERROR_IS_FATAL ANY)
if(NOT read MATCHES "joint2 +at most 0\\.")
  message(FATAL_ERROR "the reader of logs says: ${read}")
endif()

file(COPY ${example}/ DESTINATION ${strange})
build(${strange} ${strange}/build)

file(READ ${strange}/sway.toml experiment)
string(REPLACE "../../config" "${prefix}/share/tandem/config" experiment "${experiment}")
file(WRITE ${strange}/sway.toml "${experiment}")
set(ENV{TANDEM_CONTROLLERS} ${strange}/build/lib/controllers)
execute_process(COMMAND ${prefix}/bin/tandem run --no-log --duration 2 sway.toml
  WORKING_DIRECTORY ${strange} COMMAND_ERROR_IS_FATAL ANY)
# It becomes the second installed program.
execute_process(COMMAND ${prefix}/bin/tandem model info
  ${prefix}/share/tandem/config/double_pendulum/robot.toml OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${prefix}/bin/tandem check ${prefix}/share/tandem/config/double_pendulum/hold.toml
  COMMAND_ERROR_IS_FATAL ANY)

if(PYTHON)
  set(ENV{PYTHONPATH} ${prefix}/lib/python3/dist-packages)
  execute_process(COMMAND ${PYTHON} -B -c "import tandem, sys
run = tandem.Run(sys.argv[1] + '/double_pendulum/trajectory.toml', duration_s=0.1, build=False)
assert tandem.__file__.startswith(sys.argv[2]) and sum(1 for _ in run) == 100 and not run.faults"
    ${prefix}/share/tandem/config ${prefix} WORKING_DIRECTORY ${WORK} COMMAND_ERROR_IS_FATAL ANY)
endif()
