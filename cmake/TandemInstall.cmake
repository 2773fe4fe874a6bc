# What `cmake --install` lays down: the programs, their controllers and robots with the kernels that
# are built, and what it takes to build a controller elsewhere.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# All that a plugin may see: controllers/controller.hpp, hal/devices.hpp and what they include. The loader refuses a
# plugin of another version of them (kControllerInterface).
set(TANDEM_PLUGIN_HEADERS
  base/archive.hpp
  base/file_name.hpp
  base/realtime.hpp
  base/result.hpp
  base/toml_reader.hpp
  controllers/controller.hpp
  controllers/controller_io.hpp
  controllers/live_parameter.hpp
  hal/command_fields.inc
  hal/cycle_time.hpp
  hal/devices.hpp
  hal/estimate.hpp
  hal/estimate_fields.inc
  hal/follower.hpp
  hal/image.hpp
  hal/joint_capabilities.hpp
  hal/joint_devices.hpp
  hal/predictor.hpp
  hal/robot.hpp
  hal/sensor_devices.hpp
  hal/service_devices.hpp
  hal/state_fields.inc
  hal/trapezoid.hpp
  model/kernels.h
  model/kinematic_loop.hpp)

# tandem_install(): to be called when every target is there. The program looks for its parts beside
# itself, in ../lib and ../share, whatever a system calls its folders.
function(tandem_install)
  install(TARGETS tandem tandem-tools RUNTIME DESTINATION bin)
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
  # The pages, and what they name, at the places where the pages look for it. Of the examples 03 and
  # 06 are built there; 04 needs one installed header; the others link parts of the sources.
  set(doc ${CMAKE_INSTALL_DOCDIR})
  install(FILES LICENSE README.md CONTRIBUTING.md CHANGELOG.md DESTINATION ${doc})
  install(DIRECTORY docs examples DESTINATION ${doc} USE_SOURCE_PERMISSIONS
    PATTERN examples/CMakeLists.txt EXCLUDE PATTERN "*.cmake" EXCLUDE)
  install(DIRECTORY dds/tandem_msgs DESTINATION ${doc}/dds)
  install(FILES scripts/packages.txt scripts/tandem-run.service DESTINATION ${doc}/scripts)
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
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tandemConfig.cmake.in
    ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/installed/tandemConfig.cmake
    ${PROJECT_BINARY_DIR}/installed/tandemConfigVersion.cmake cmake/TandemController.cmake cmake/plugin.map
    DESTINATION ${package})
endfunction()
