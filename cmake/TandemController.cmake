# tandem_add_controller(NAME SOURCES … LINKS … [FOLDER dir]): the plugin NAME.so, found by its name
# in lib/controllers of the project's build folder (or dir). For this project's own controllers, and
# by find_package(tandem) for everybody's.
function(tandem_add_controller name)
  cmake_parse_arguments(PLUGIN "" "FOLDER" "SOURCES;LINKS" ${ARGN})
  if(NOT PLUGIN_FOLDER)
    set(PLUGIN_FOLDER ${PROJECT_BINARY_DIR}/lib/controllers)
  endif()
  add_library(controller_${name} MODULE ${PLUGIN_SOURCES})
  target_link_libraries(controller_${name} PRIVATE tandem::plugin ${PLUGIN_LINKS})
  if(TARGET tandem_pch)
    target_precompile_headers(controller_${name} REUSE_FROM tandem_pch)  # with its flags
  else()
    # Nothing that is one for the whole process, which would keep a former build at work; and never
    # without optimisation by oversight: that takes many times as long in every cycle. Lines, for the
    # stack of a crash, where the build asks for no debug information: the last -g counts.
    set(lines $<$<NOT:$<CONFIG:Debug,RelWithDebInfo>>:-g1>)
    if(CMAKE_CXX_FLAGS MATCHES "(^| )-g")
      set(lines)
    endif()
    target_compile_options(controller_${name} PRIVATE ${lines}
      $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique> $<$<STREQUAL:$<CONFIG>,>:-O2>)
  endif()
  # Nothing undefined that the loader would find missing, nothing exported but the entry point: a
  # symbol that is one for the whole process would keep a library from ever being closed.
  # (A sanitizer's symbols stay undefined until then: they are in the executable.)
  set(exports ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/plugin.map)
  target_link_options(controller_${name} PRIVATE "SHELL:-Xlinker \"--version-script=${exports}\"")
  set_property(TARGET controller_${name} APPEND PROPERTY LINK_DEPENDS ${exports})
  if(NOT TANDEM_SANITIZE)
    target_link_options(controller_${name} PRIVATE -Wl,--no-undefined)
  endif()
  set_target_properties(controller_${name} PROPERTIES PREFIX "" OUTPUT_NAME ${name}
    CXX_VISIBILITY_PRESET hidden LIBRARY_OUTPUT_DIRECTORY ${PLUGIN_FOLDER}
    POSITION_INDEPENDENT_CODE ON)
endfunction()
