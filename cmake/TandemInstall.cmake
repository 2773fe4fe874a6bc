# What `cmake --install` lays down: the programs, their controllers and robots with the kernels that
# are built, and what it takes to build a controller elsewhere.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# All that a plugin may see: these two and what they include. The loader refuses a plugin of another
# version of them (kControllerInterface).
set(TANDEM_PLUGIN_HEADERS)
set(headers controllers/controller.hpp hal/devices.hpp)
while(headers)
  list(POP_FRONT headers header)
  if(header IN_LIST TANDEM_PLUGIN_HEADERS)
    continue()
  endif()
  list(APPEND TANDEM_PLUGIN_HEADERS ${header})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
  file(STRINGS ${PROJECT_SOURCE_DIR}/${header} lines REGEX "^#include \"")
  list(TRANSFORM lines REPLACE "^#include \"([^\"]*)\".*" "\\1")
  list(APPEND headers ${lines})
endwhile()

# tandem_install(): to be called when every target is there. The program looks for its parts beside
# itself, in ../lib and ../share, whatever a system calls its folders.
function(tandem_install)
  install(TARGETS tandem tandem-tools RUNTIME DESTINATION bin)
  if(TARGET tandem_gate)
    install(TARGETS tandem_gate DESTINATION lib/tandem)
  endif()
  foreach(name IN LISTS TANDEM_BUNDLED_CONTROLLERS)
    install(TARGETS controller_${name} DESTINATION lib/tandem/controllers)
  endforeach()
  get_property(engines GLOBAL PROPERTY TANDEM_ENGINES)
  foreach(name IN LISTS engines)
    install(TARGETS engine_${name} DESTINATION lib/tandem/engines)
  endforeach()
  install(DIRECTORY ${PROJECT_BINARY_DIR}/lib/models/ DESTINATION lib/tandem/models
    FILES_MATCHING PATTERN "*_kernels.so")
  install(DIRECTORY config/ DESTINATION share/tandem/config
    PATTERN CMakeLists.txt EXCLUDE)
  # The pages, and what they name, at the places where the pages look for it. Of the examples 03, 06
  # and 08 are built there; 04 needs one installed header; the others link parts of the sources.
  set(doc ${CMAKE_INSTALL_DOCDIR})
  install(FILES LICENSE README.md CONTRIBUTING.md CHANGELOG.md DESTINATION ${doc})
  install(DIRECTORY docs examples DESTINATION ${doc} USE_SOURCE_PERMISSIONS
    PATTERN examples/CMakeLists.txt EXCLUDE PATTERN "*.cmake" EXCLUDE)
  install(DIRECTORY dds/tandem_msgs DESTINATION ${doc}/dds)
  install(FILES scripts/packages.txt scripts/tandem@.service DESTINATION ${doc}/scripts)
  install(FILES scripts/tandem@.service DESTINATION lib/systemd/system)
  install(FILES tests/mutations.md DESTINATION ${doc}/tests)
  install(FILES tests/hil/README.md DESTINATION ${doc}/tests/hil)
  install(CODE "set(doc \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${doc}\")
    file(RELATIVE_PATH config \"/${doc}\" /share/tandem/config)
    file(REMOVE \"\${doc}/config\")
    file(CREATE_LINK \"\${config}\" \"\${doc}/config\" SYMBOLIC)")

  foreach(header IN LISTS TANDEM_PLUGIN_HEADERS)
    cmake_path(GET header PARENT_PATH folder)
    install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem/${folder})
  endforeach()
  install(TARGETS tandem_options tandem_base tandem_hal EXPORT tandem
    ARCHIVE DESTINATION lib/tandem
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem)
  set(package lib/cmake/tandem)
  install(EXPORT tandem NAMESPACE tandem:: FILE tandemTargets.cmake DESTINATION ${package})
  # In a folder of its own: find_package() would find it in the build folder, whose bin/ is in PATH.
  set(TANDEM_ROBOTS_PATH "\${PACKAGE_PREFIX_DIR}/share/tandem/config")
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tandemConfig.cmake.in
    ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake
    ${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake cmake/TandemController.cmake cmake/plugin.map
    DESTINATION ${package})

  # The same of the build folder, for who names it by tandem_DIR, as `tandem controller new` does.
  set(package ${PROJECT_BINARY_DIR}/package)
  set(TANDEM_ROBOTS_PATH "${PROJECT_SOURCE_DIR}/config")
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tandemConfig.cmake.in
    ${package}/tandemConfig.cmake INSTALL_DESTINATION package INSTALL_PREFIX ${PROJECT_BINARY_DIR})
  foreach(file TandemController.cmake plugin.map)
    configure_file(${PROJECT_SOURCE_DIR}/cmake/${file} ${package}/${file} COPYONLY)
  endforeach()
  export(EXPORT tandem NAMESPACE tandem:: FILE ${package}/tandemTargets.cmake)
endfunction()
