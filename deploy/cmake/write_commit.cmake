# cmake -DSOURCE=DIR -DOUT=HEADER -P write_commit.cmake: writes SACCADE_COMMIT, if it is another one.
set(commit "")
find_program(git git)
if(git AND EXISTS ${SOURCE}/.git)  # not that of a repository which this tree lies in
  # safe.directory: whoever builds may not be who cloned. No locks: somebody may be committing.
  execute_process(
    COMMAND ${git} --no-optional-locks -c safe.directory=* -C ${SOURCE}
            describe --always --exclude=* --abbrev=9 --dirty=+dirty
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(commit STREQUAL "")
  file(STRINGS ${SOURCE}/deploy/cmake/commit.txt commit LIMIT_COUNT 1)  # `git archive` fills it in
  if(NOT commit MATCHES "^[0-9a-f]+$")
    set(commit "commit unknown")
  endif()
endif()
set(text "#define SACCADE_COMMIT \"${commit}\"\n")
set(old "")
if(EXISTS ${OUT})
  file(READ ${OUT} old)
endif()
if(NOT text STREQUAL old)
  file(WRITE ${OUT} "${text}")
endif()
