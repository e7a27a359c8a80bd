# Run by CTest; see CMakeLists.txt. What was compiled stays for the next run; what is installed and uses it is made anew.
file(REMOVE_RECURSE ${WORK}/installed ${WORK}/consumer)

include(${CMAKE_CURRENT_LIST_DIR}/must_run.cmake)

foreach(package TBB SuiteSparse OpenVDB embree CGAL PNG OpenCV NLopt fmt nlohmann_json tomlplusplus CLI11 nanoflann LBFGSpp)
  list(APPEND without -DCMAKE_DISABLE_FIND_PACKAGE_${package}=ON)
endforeach()
must_run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=None
  -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" "-DCMAKE_CXX_FLAGS=${FLAGS}"
  -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DPLIANT_BUILD_TESTS=OFF
  -DPLIANT_MOTION_ONLY=ON -DPLIANT_WITH_TBB=OFF -DPLIANT_WITH_CHOLMOD=OFF ${without})
must_run(${CMAKE_COMMAND} --build ${WORK}/build -j 2)
must_run(${CMAKE_COMMAND} --install ${WORK}/build --prefix ${WORK}/installed)

# A body of its own, moved by what was installed. Compiled without optimisation, it moves for a few frames.
file(WRITE ${WORK}/consumer/CMakeLists.txt [[
cmake_minimum_required(VERSION 3.25)
project(consumer LANGUAGES CXX)
find_package(pliant REQUIRED)
add_executable(consumer main.cpp)
target_link_libraries(consumer PRIVATE pliant::motion)
]])
file(READ ${SOURCE}/tests/packaging/motion_only.cpp program)
string(REPLACE "frame <= 30" "frame <= 3" program "${program}")
file(WRITE ${WORK}/consumer/main.cpp "${program}")
must_run(${CMAKE_COMMAND} -S ${WORK}/consumer -B ${WORK}/consumer/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=None
  -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" "-DCMAKE_CXX_FLAGS=${FLAGS}"
  -DCMAKE_PREFIX_PATH=${WORK}/installed ${without})
must_run(${CMAKE_COMMAND} --build ${WORK}/consumer/build)
must_run(${WORK}/consumer/build/consumer)
string(REGEX MATCHALL "[0-9.]+ m" heights "${output}")
list(LENGTH heights count)
if(NOT count EQUAL 4)
  message(FATAL_ERROR "4 heights were expected:\n${output}")
endif()
