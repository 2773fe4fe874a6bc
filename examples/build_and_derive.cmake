# Runs example 07 on the double pendulum's kernels with derivatives, as its first lines say.
file(REMOVE_RECURSE ${WORK})
file(COPY ${ROBOT}/ DESTINATION ${WORK})
file(READ ${WORK}/robot.toml robot)
string(REPLACE "[model]" "[model]\nderivatives = true" robot "${robot}")
file(WRITE ${WORK}/robot.toml "${robot}")
execute_process(COMMAND ${TANDEM} model build ${WORK}/robot.toml -o ${WORK}/kernels.so
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${EXAMPLE} ${WORK}/kernels.so COMMAND_ERROR_IS_FATAL ANY)
