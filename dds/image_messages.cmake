# The messages that carry process images: their fields are the rows of the images' tables.

# tandem_image_message(State TABLE): gives dds/tandem_msgs/msg/State.msg the rows of TABLE as its
# last fields, and appends TANDEM_STATE(the message's member, the image's), a line per row, to the
# caller's variable image_members.
function(tandem_image_message name table)
  set(message ${CMAKE_CURRENT_SOURCE_DIR}/tandem_msgs/msg/${name}.msg)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${table} ${message})
  cmake_path(RELATIVE_PATH table BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE short)
  string(TOUPPER ${name} upper)

  set(fields "")
  file(STRINGS ${table} rows REGEX "^TANDEM_FIELD")
  foreach(row IN LISTS rows)
    if(NOT row MATCHES "^TANDEM_FIELD\\(([a-z0-9_:]+), ([A-Za-z0-9_]+), ([^\"]+), \"([^\"]*)\"\\)$")
      message(FATAL_ERROR "${short}: '${row}' is no TANDEM_FIELD(type, name, count, \"doc\")")
    endif()
    set(doc "${CMAKE_MATCH_4}")
    set(count "${CMAKE_MATCH_3}")
    set(member ${CMAKE_MATCH_2})
    string(REGEX REPLACE "^std::|_t$" "" type ${CMAKE_MATCH_1})
    string(REGEX REPLACE "^double$" "float64" type ${type})
    if(NOT count STREQUAL "1")
      string(APPEND type "[]")
    endif()
    string(TOLOWER ${member} wire)  # hal/wire_name.hpp
    string(APPEND fields "${type} ${wire}  # ${doc}\n")
    string(APPEND image_members "TANDEM_${upper}(${wire}, ${member})\n")
  endforeach()

  # The text up to the line that names the table is written by hand.
  set(mark "# The fields of ${short}, which the build writes here:\n")
  file(READ ${message} old)
  string(FIND "${old}" "${mark}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "${message}: there is no line '${mark}'")
  endif()
  string(SUBSTRING "${old}" 0 ${at} head)
  set(text "${head}${mark}${fields}")
  if(NOT text STREQUAL old)
    message(STATUS "dds/tandem_msgs/msg/${name}.msg follows ${short}: commit both")
    file(WRITE ${message} "${text}")
  endif()

  set(image_members "${image_members}" PARENT_SCOPE)
endfunction()
