# Runs a robot in the background of an example that listens to it: TANDEM, LISTENER, EXPERIMENT,
# DOMAIN.
execute_process(
  COMMAND ${TANDEM} run ${EXPERIMENT} --dds --domain ${DOMAIN} --no-log -q --no-socket --realtime
          --duration 10
  COMMAND ${LISTENER} 10 ${DOMAIN}
  OUTPUT_VARIABLE heard ERROR_VARIABLE problems RESULTS_VARIABLE status)
message("${heard}")
if(NOT status STREQUAL "0;0")
  message(FATAL_ERROR "run and listener ended with ${status}: ${problems}")
endif()
