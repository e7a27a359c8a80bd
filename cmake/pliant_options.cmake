# Private compile settings of the project's own targets; nothing here reaches a consumer.
add_library(pliant_options INTERFACE)
target_compile_features(pliant_options INTERFACE cxx_std_20)
target_compile_options(pliant_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow)
# GCC 12 sees overlapping and endless copies in "text" + std::string where there are none (its bugs 105329 and 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(pliant_options INTERFACE -Wno-restrict -Wno-maybe-uninitialized -Wno-psabi
    -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds -Wno-uninitialized)
endif()
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(pliant_options INTERFACE -Wno-subobject-linkage) # takes the sources of a batch for headers
endif()
if(PLIANT_WITH_PYTHON) # the modules become parts of a shared library; programs alike, for one set of precompiled headers
  target_compile_options(pliant_options INTERFACE -fPIC -fno-semantic-interposition)
endif()
if(PLIANT_WARNINGS_AS_ERRORS)
  target_compile_options(pliant_options INTERFACE -Werror)
endif()
# What compiles for this machine's processor. GCC 12 takes 3 x 3 products apart wrongly with 512-bit registers, at every level of
# optimisation: one node of an element got another force than its matrix says. With 256 bits a fit takes as long.
set(pliant_native_flags -march=native)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  list(APPEND pliant_native_flags -mno-avx512f)
endif()
if(PLIANT_NATIVE)
  target_compile_options(pliant_options INTERFACE ${pliant_native_flags})
endif()

# ccache takes objects compiled with precompiled headers only where it is told that macros and times in them do not matter, and
# those of another clone of these sources only where paths are taken from the clone's root on.
if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "(^|/)ccache$")
  set(CMAKE_CXX_COMPILER_LAUNCHER env CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
    ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()

# Headers that nearly every source reads, compiled once for all targets that take them by pliant_reuse: a target without
# code of its own. Each source still includes what it needs: -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON builds the same.
function(pliant_precompile name)
  cmake_parse_arguments(PRECOMPILE "" "" "HEADERS;DEPENDS" ${ARGN})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp)
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_link_libraries(${name} PRIVATE pliant_options ${PRECOMPILE_DEPENDS})
  target_precompile_headers(${name} PRIVATE ${PRECOMPILE_HEADERS})
endfunction()

function(pliant_reuse target name)
  target_precompile_headers(${target} REUSE_FROM ${name})
endfunction()

pliant_precompile(pliant_headers
  HEADERS <algorithm> <array> <cmath> <cstdint> <cstdio> <cstring> <filesystem> <functional> <limits> <map> <memory> <numbers>
    <numeric> <optional> <set> <span> <sstream> <stdexcept> <string> <string_view> <utility> <vector> <Eigen/Dense>
  DEPENDS Eigen3::Eigen)

# A module of the library: pliant_module(name SOURCES... DEPENDS...)
function(pliant_module name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  add_library(pliant_${name} STATIC ${MODULE_SOURCES})
  add_library(pliant::${name} ALIAS pliant_${name})
  set_target_properties(pliant_${name} PROPERTIES EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY PLIANT_MODULES ${name})
  target_include_directories(pliant_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:include/pliant>)
  target_compile_features(pliant_${name} PUBLIC cxx_std_20)
  if(PLIANT_NATIVE) # Eigen aligns by the processor's vectors: who links such a library must be compiled alike
    target_compile_options(pliant_${name} INTERFACE "$<INSTALL_INTERFACE:${pliant_native_flags}>")
  endif()
  target_link_libraries(pliant_${name} PUBLIC ${MODULE_DEPENDS} PRIVATE $<BUILD_INTERFACE:pliant_options> ${MODULE_PRIVATE_DEPENDS})
  pliant_reuse(pliant_${name} pliant_headers)
endfunction()

# Stops where a target links, itself or by what it links, one of the libraries that it must do without:
# pliant_must_not_link(target library...)
function(pliant_must_not_link target)
  set(seen)
  set(open ${target})
  get_target_property(own ${target} LINK_LIBRARIES)
  list(APPEND open ${own})
  while(open)
    list(POP_FRONT open next)
    string(REGEX REPLACE "^\\$<(LINK_ONLY|BUILD_INTERFACE):(.*)>$" "\\2" next "${next}")
    string(REGEX REPLACE "^\\$<(LINK_ONLY|BUILD_INTERFACE):(.*)>$" "\\2" next "${next}")
    if(next IN_LIST seen)
      continue()
    endif()
    list(APPEND seen ${next})
    if(NOT TARGET ${next})
      continue()
    endif()
    get_target_property(alias ${next} ALIASED_TARGET)
    if(alias)
      list(APPEND seen ${alias})
    endif()
    get_target_property(further ${next} INTERFACE_LINK_LIBRARIES)
    if(further)
      list(APPEND open ${further})
    endif()
  endwhile()
  foreach(library IN LISTS ARGN)
    if(library IN_LIST seen)
      message(FATAL_ERROR "${target} links ${library}, which it must do without")
    endif()
  endforeach()
endfunction()

# Tests of one module: pliant_test(module SOURCES... DEPENDS...)
function(pliant_test name)
  cmake_parse_arguments(TEST "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name}_test ${TEST_SOURCES})
  target_include_directories(${name}_test PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(${name}_test PRIVATE PLIANT_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(${name}_test PRIVATE ${TEST_DEPENDS} pliant_test_support pliant_options GTest::gmock GTest::gtest_main)
  pliant_reuse(${name}_test pliant_test_headers)
  gtest_discover_tests(${name}_test PROPERTIES LABELS ${name} DISCOVERY_TIMEOUT 60 TEST_PREFIX "${name}/")
endfunction()
