# Runs a command; fails with what it wrote where it fails, else leaves that in `output`.
function(must_run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT code EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nreturned ${code}:\n${out}")
  endif()
  set(output "${out}" PARENT_SCOPE)
endfunction()
