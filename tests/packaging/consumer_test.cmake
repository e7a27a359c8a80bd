# Run by CTest; see CMakeLists.txt.
file(REMOVE_RECURSE ${WORK})

include(${CMAKE_CURRENT_LIST_DIR}/must_run.cmake)

must_run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
must_run(${WORK}/installed/bin/pliant --version)
must_run(${CMAKE_COMMAND} -S ${SOURCE}/examples/consumer -B ${WORK}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
  -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS} -DCMAKE_PREFIX_PATH=${WORK}/installed)
must_run(${CMAKE_COMMAND} --build ${WORK}/build)
must_run(${WORK}/build/consumer)

# It falls, is stopped by the floor about a radius above it, and comes up again.
string(REGEX MATCHALL "[-0-9.]+ m" heights "${output}")
list(TRANSFORM heights REPLACE " m" "")
list(LENGTH heights count)
if(NOT count EQUAL 31)
  message(FATAL_ERROR "31 heights were expected:\n${output}")
endif()
list(GET heights 0 first)
set(lowest 0)
foreach(height IN LISTS heights)
  if(height LESS lowest)
    set(lowest ${height})
  endif()
endforeach()
list(GET heights 30 last)
if(NOT (first EQUAL 0 AND lowest GREATER -0.07 AND lowest LESS -0.05 AND last GREATER lowest))
  message(FATAL_ERROR "this is no bouncing ball:\n${output}")
endif()

# The README shows what was just built, to the letter.
file(READ ${SOURCE}/README.md readme)
foreach(file CMakeLists.txt main.cpp)
  file(READ ${SOURCE}/examples/consumer/${file} text)
  string(FIND "${readme}" "${text}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "README.md does not show examples/consumer/${file} as it is")
  endif()
endforeach()
