# Runs example 03 and reads its log with example 02, as their first lines say.
file(REMOVE_RECURSE ${RUNS})
set(ENV{TANDEM_CONTROLLERS} ${CONTROLLERS})
execute_process(COMMAND ${TANDEM} run --quiet --log ${RUNS} ${EXPERIMENT}
  COMMAND_ERROR_IS_FATAL ANY)
file(GLOB_RECURSE logs ${RUNS}/*.mcap)
execute_process(COMMAND ${READER} ${logs} COMMAND_ERROR_IS_FATAL ANY)
