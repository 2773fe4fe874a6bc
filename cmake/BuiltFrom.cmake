# Writes OUT, the source of built_from(): the commit that SOURCE is at, as `git describe` says, with
# "-dirty" when files differ from it. Empty where SOURCE is no checkout. A file that says the same
# is left alone, so that nothing is built again.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git -C ${SOURCE} rev-parse --show-cdup
  OUTPUT_VARIABLE up ERROR_QUIET RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE)
set(commit "")
if(failed EQUAL 0 AND up STREQUAL "") # else SOURCE lies in a checkout of something else
  execute_process(COMMAND git -C ${SOURCE} describe --always --tags --dirty
    OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
file(CONFIGURE OUTPUT ${OUT} CONTENT
"// Written by cmake/BuiltFrom.cmake.
namespace tandem::runtime {
extern const char* const kBuiltFrom;
const char* const kBuiltFrom = \"${commit}\";
}  // namespace tandem::runtime
")
