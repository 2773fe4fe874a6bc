# What `cmake --install` lays down: the program, its controllers and robots with the kernels that
# are built, and what it takes to build a controller elsewhere.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# All that a plugin may see: controllers/controller.hpp, hal/devices.hpp and what they include. The loader refuses a
# plugin of another version of them (kControllerInterface).
set(TANDEM_PLUGIN_HEADERS
  base/archive.hpp
  base/realtime.hpp
  base/result.hpp
  base/toml_reader.hpp
  controllers/controller.hpp
  hal/command_fields.inc
  hal/cycle_time.hpp
  hal/devices.hpp
  hal/estimate.hpp
  hal/estimate_fields.inc
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
  model/loop_spec.hpp)

# tandem_install(): to be called when every target is there. The program looks for its parts beside
# itself, in ../lib and ../share, whatever a system calls its folders.
function(tandem_install)
  install(TARGETS tandem RUNTIME DESTINATION bin)
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
  install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
  install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs)
  # The examples' robot lies elsewhere then.
  foreach(controller 03_controller/sway 06_devices/reach)
    set(example examples/${controller})
    cmake_path(GET example PARENT_PATH folder)
    cmake_path(GET example FILENAME name)
    file(READ ${example}.toml experiment)
    string(REPLACE "../../config" "../../../../tandem/config" experiment "${experiment}")
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/installed/${name}.toml CONTENT "${experiment}" @ONLY)
    install(FILES ${folder}/CMakeLists.txt ${example}.cpp
      ${PROJECT_BINARY_DIR}/installed/${name}.toml DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
  endforeach()

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
