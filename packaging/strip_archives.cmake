# CPack strips programs; static libraries lose here what only names the compiler, and times.
file(GLOB_RECURSE archives ${CMAKE_CURRENT_BINARY_DIR}/*.a)
foreach(archive ${archives})
  execute_process(COMMAND strip --strip-debug --enable-deterministic-archives --remove-section=.comment ${archive}
    COMMAND_ERROR_IS_FATAL ANY)
endforeach()
