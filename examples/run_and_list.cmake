# Runs example 08, and lists what its run and its log have of all that it declares.
file(REMOVE_RECURSE ${RUNS})
set(ENV{TANDEM_CONTROLLERS} ${CONTROLLERS})
execute_process(COMMAND ${TANDEM} run --log ${RUNS} --json ${RUNS}.json ${EXPERIMENT}
  COMMAND_ERROR_IS_FATAL ANY)
file(READ ${RUNS}.json run)
string(JSON said GET "${run}" texts said)
message("said ${said}")
file(GLOB_RECURSE logs ${RUNS}/*.mcap)
execute_process(COMMAND ${TANDEM} log info ${logs} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${TANDEM} log csv ${logs} --topic /tandem/controller/nod --every 1000
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${TANDEM} log csv ${logs} --topic /tandem/input/nod/depth
  COMMAND_ERROR_IS_FATAL ANY)
