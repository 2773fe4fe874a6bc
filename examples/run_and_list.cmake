# Runs example 08, and lists what its log has of it.
file(REMOVE_RECURSE ${RUNS})
set(ENV{TANDEM_CONTROLLERS} ${CONTROLLERS})
execute_process(COMMAND ${TANDEM} run --log ${RUNS} ${EXPERIMENT} COMMAND_ERROR_IS_FATAL ANY)
file(GLOB_RECURSE logs ${RUNS}/*.mcap)
execute_process(COMMAND ${TANDEM} log csv ${logs} --topic /tandem/controller/nod --every 1000
  COMMAND_ERROR_IS_FATAL ANY)
