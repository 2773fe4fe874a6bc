# What `cmake --install` lays down, in components, of which Debian's packages are made (debian/):
#   program  the programs, their controllers and engines, the pages, the manual, completion
#   robots   the bundled robots and their kernels, as far as these are built
#   dev      what it takes to build a controller, or a reader of logs, elsewhere
#   python   the Python module (python/CMakeLists.txt)
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(TANDEM_COMPONENTS program robots dev python)
set(TANDEM_ZSH_FOLDER ${CMAKE_INSTALL_DATADIR}/zsh/site-functions CACHE STRING
  "Where zsh's completion is installed")

# tandem_headers(OUT HEADER …): these and what they include.
function(tandem_headers out)
  set(all)
  set(headers ${ARGN})
  while(headers)
    list(POP_FRONT headers header)
    if(header IN_LIST all)
      continue()
    endif()
    list(APPEND all ${header})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
    file(STRINGS ${PROJECT_SOURCE_DIR}/${header} lines REGEX "^#include \"")
    list(TRANSFORM lines REPLACE "^#include \"([^\"]*)\".*" "\\1")
    list(APPEND headers ${lines})
  endwhile()
  set(${out} ${all} PARENT_SCOPE)
endfunction()

# package_files: all that is installed, and no more (the preset `package`).
add_custom_target(package_files)

# tandem_man(): the manual's pages, as the program writes them.
function(tandem_man)
  set(folder ${PROJECT_BINARY_DIR}/man)
  if(TANDEM_SANITIZE OR TANDEM_FUZZ)
    return()
  endif()
  add_custom_command(OUTPUT ${folder}/tandem.1 COMMAND ${CMAKE_COMMAND} -E rm -rf ${folder}
    COMMAND tandem help --man ${folder} DEPENDS tandem VERBATIM COMMENT "The manual's pages")
  add_custom_target(man ALL DEPENDS ${folder}/tandem.1)
  add_dependencies(package_files man)
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
endfunction()

# tandem_install(): to be called when every target is there. The program looks for its parts beside
# itself, in ../lib and ../share, whatever a system calls its folders.
function(tandem_install)
  install(TARGETS tandem tandem-tools RUNTIME DESTINATION bin COMPONENT program)
  if(TARGET tandem_gate)
    install(TARGETS tandem_gate LIBRARY DESTINATION lib/tandem COMPONENT program)
  endif()
  foreach(name IN LISTS TANDEM_BUNDLED_CONTROLLERS)
    install(TARGETS controller_${name} LIBRARY DESTINATION lib/tandem/controllers COMPONENT program)
  endforeach()
  get_property(engines GLOBAL PROPERTY TANDEM_ENGINES)
  foreach(name IN LISTS engines)
    install(TARGETS engine_${name} LIBRARY DESTINATION lib/tandem/engines COMPONENT program)
  endforeach()
  # Some may be links to another build's (TANDEM_MODELS_FROM).
  install(CODE "file(GLOB libraries \"${PROJECT_BINARY_DIR}/lib/models/*_kernels.so\")
    foreach(library IN LISTS libraries)
      get_filename_component(name \"\${library}\" NAME)
      file(REAL_PATH \"\${library}\" whole)
      file(INSTALL \"\${whole}\" DESTINATION \"\${CMAKE_INSTALL_PREFIX}/lib/tandem/models\" RENAME \"\${name}\")
    endforeach()" COMPONENT robots)
  install(DIRECTORY config/ DESTINATION share/tandem/config COMPONENT robots
    PATTERN CMakeLists.txt EXCLUDE)
  tandem_man()
  install(FILES scripts/completion.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    RENAME tandem COMPONENT program)
  install(FILES scripts/completion.zsh DESTINATION ${TANDEM_ZSH_FOLDER} RENAME _tandem COMPONENT program)
  install(FILES scripts/completion.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d
    RENAME tandem.fish COMPONENT program)

  # The pages, and what they name, at the places where the pages look for it.
  set(doc ${CMAKE_INSTALL_DOCDIR})
  install(FILES LICENSE README.md CONTRIBUTING.md CHANGELOG.md DESTINATION ${doc} COMPONENT program)
  install(DIRECTORY docs DESTINATION ${doc} COMPONENT program)
  install(DIRECTORY dds/tandem_msgs dds/ros2 dds/idl DESTINATION ${doc}/dds COMPONENT program)
  install(FILES scripts/packages.txt scripts/tandem@.service scripts/completion.bash
    DESTINATION ${doc}/scripts COMPONENT program)
  install(FILES tests/mutations.md DESTINATION ${doc}/tests COMPONENT program)
  install(FILES tests/hil/README.md DESTINATION ${doc}/tests/hil COMPONENT program)
  install(FILES scripts/tandem@.service DESTINATION lib/systemd/system COMPONENT program)
  install(CODE "set(doc \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${doc}\")
    file(RELATIVE_PATH config \"/${doc}\" /share/tandem/config)
    file(MAKE_DIRECTORY \"\${doc}\")
    file(REMOVE \"\${doc}/config\")
    file(CREATE_LINK \"\${config}\" \"\${doc}/config\" SYMBOLIC)" COMPONENT robots)
  # Examples that are compiled are for `dev`. Of these 03, 06 and 08 are projects of their own, 02
  # needs tandem::log, 04 one header; the others link parts of the sources.
  file(GLOB examples LIST_DIRECTORIES true examples/*)
  foreach(example IN LISTS examples)
    get_filename_component(name ${example} NAME)
    set(component program)
    if(name MATCHES "\\.cpp$" OR EXISTS ${example}/CMakeLists.txt)
      set(component dev)
    endif()
    if(IS_DIRECTORY ${example})
      install(DIRECTORY ${example} DESTINATION ${doc}/examples USE_SOURCE_PERMISSIONS COMPONENT ${component})
    elseif(component STREQUAL dev)
      install(FILES ${example} DESTINATION ${doc}/examples COMPONENT dev)
    endif()
  endforeach()

  # All that a plugin may see, of which the loader refuses another version (kControllerInterface); and
  # the reader of logs.
  tandem_headers(headers controllers/controller.hpp hal/devices.hpp log/log_file.hpp)
  foreach(header IN LISTS headers)
    cmake_path(GET header PARENT_PATH folder)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem/${folder} COMPONENT dev)
  endforeach()
  set(package lib/cmake/tandem)
  set(sets "tandem\;tandem_options\;tandem_base\;tandem_hal" "tandemLog\;tandem_log\;tandem_trust")
  foreach(targets IN LISTS sets)
    list(POP_FRONT targets name)
    install(TARGETS ${targets} EXPORT ${name} ARCHIVE DESTINATION lib/tandem COMPONENT dev
      INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem)
    install(EXPORT ${name} NAMESPACE tandem:: FILE ${name}Targets.cmake DESTINATION ${package} COMPONENT dev)
  endforeach()
  # In a folder of its own: find_package() would find it in the build folder, whose bin/ is in PATH.
  set(TANDEM_ROBOTS_PATH "\${PACKAGE_PREFIX_DIR}/share/tandem/config")
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tandemConfig.cmake.in
    ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  add_dependencies(package_files tandem kernels engines tandem_log)
  if(TARGET tandem_python)
    add_dependencies(package_files tandem_python)
  endif()
  install(FILES ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake
    ${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake cmake/TandemController.cmake cmake/plugin.map
    DESTINATION ${package} COMPONENT dev)

  # The same of the build folder, for who names it by tandem_DIR, as `tandem controller new` does.
  set(package ${PROJECT_BINARY_DIR}/package)
  set(TANDEM_ROBOTS_PATH "${PROJECT_SOURCE_DIR}/config")
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tandemConfig.cmake.in
    ${package}/tandemConfig.cmake INSTALL_DESTINATION package INSTALL_PREFIX ${PROJECT_BINARY_DIR})
  foreach(file TandemController.cmake plugin.map)
    configure_file(${PROJECT_SOURCE_DIR}/cmake/${file} ${package}/${file} COPYONLY)
  endforeach()
  foreach(name tandem tandemLog)
    export(EXPORT ${name} NAMESPACE tandem:: FILE ${package}/${name}Targets.cmake)
  endforeach()
endfunction()
