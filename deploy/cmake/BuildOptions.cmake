if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  set(oldest armv8-a)
else()
  set(oldest x86-64-v3)
endif()
set(SACCADE_ARCH ${oldest} CACHE STRING "Value for -march=: the oldest processor to run on")

# Flags that every target of ours is built with, and the shared precompiled headers.
add_library(saccade_build_options INTERFACE)
target_compile_features(saccade_build_options INTERFACE cxx_std_20)
target_compile_options(saccade_build_options INTERFACE
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wnon-virtual-dtor -march=${SACCADE_ARCH}
  # GCC 12 false positives inside Eigen, protobuf and <regex> once inlined.
  -Wno-error=maybe-uninitialized -Wno-error=array-bounds -Wno-error=stringop-overflow
  -Wno-error=stringop-overread -Wno-error=restrict -Wno-error=dangling-pointer -Wno-psabi)
# Eigen objects keep malloc's alignment, whatever the instruction set (architecture, section 7).
target_compile_definitions(saccade_build_options INTERFACE EIGEN_MAX_ALIGN_BYTES=16)
target_include_directories(saccade_build_options INTERFACE ${CMAKE_SOURCE_DIR})
if(SACCADE_SANITIZER)
  target_compile_options(saccade_build_options INTERFACE
    -fsanitize=${SACCADE_SANITIZER} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  if(SACCADE_SANITIZER MATCHES "undefined")
    # A third of the time to compile, for what the address sanitizer or the processor stops at anyway.
    target_compile_options(saccade_build_options INTERFACE
      -fno-sanitize=null,alignment,vptr,object-size,pointer-overflow)
  endif()
  target_link_options(saccade_build_options INTERFACE -fsanitize=${SACCADE_SANITIZER})
endif()

# Says in one line that the processor is too old; itself it runs on any.
add_library(saccade_cpu_check OBJECT ${CMAKE_CURRENT_LIST_DIR}/cpu_check.cpp)
if(SACCADE_ARCH STREQUAL x86-64-v3)
  target_compile_options(saccade_cpu_check PRIVATE -march=x86-64)
  target_compile_definitions(saccade_cpu_check PRIVATE SACCADE_NEEDS_X86_64_V3)
endif()

# Several sources as one unit: Eigen's and gRPC's templates are instantiated once for all of them. For
# whoever builds everything (deploy/); whoever edits one file wants it off.
option(SACCADE_UNITY "Compile several sources of a target as one unit" OFF)
if(SACCADE_UNITY)
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)
  # The warning is about headers; a unit includes sources.
  target_compile_options(saccade_build_options INTERFACE -Wno-subobject-linkage)
endif()

# saccade_library(NAME SOURCES ... PUBLIC ... PRIVATE ... [PCH eigen|vision|rpc])
# A static library that carries the build options. SYSTEM keeps generated headers out of -Werror.
function(saccade_library name)
  cmake_parse_arguments(ARG "" "PCH" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC saccade_build_options ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  saccade_precompile(${name} "${ARG_PCH}")
endfunction()

# saccade_executable(NAME SOURCES ... LIBS ... [PCH ...])
function(saccade_executable name)
  cmake_parse_arguments(ARG "" "PCH" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES} $<TARGET_OBJECTS:saccade_cpu_check>)
  target_link_libraries(${name} PRIVATE saccade_build_options ${ARG_LIBS})
  saccade_precompile(${name} "${ARG_PCH}")
endfunction()

# KIND: eigen, vision or rpc; for tests test_eigen or test_vision.
function(saccade_precompile name kind)
  if(kind AND NOT TARGET saccade_pch_${kind})
    message(FATAL_ERROR "saccade_precompile: unknown kind '${kind}'")
  elseif(kind)
    target_precompile_headers(${name} REUSE_FROM saccade_pch_${kind})
  endif()
endfunction()

# Written only if it differs: otherwise each run of CMake would compile nearly everything anew.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/pch.cpp CONTENT "namespace {}\n")
foreach(kind eigen vision rpc)
  add_library(saccade_pch_${kind} STATIC ${CMAKE_BINARY_DIR}/pch.cpp)
  target_link_libraries(saccade_pch_${kind} PRIVATE saccade_build_options Eigen3::Eigen)
endforeach()
target_precompile_headers(saccade_pch_eigen PRIVATE <Eigen/Dense> <vector> <string> <memory>)
target_link_libraries(saccade_pch_vision PRIVATE OpenCV::core OpenCV::imgproc)
target_precompile_headers(saccade_pch_vision PRIVATE
  <Eigen/Dense> <opencv2/core.hpp> <opencv2/imgproc.hpp> <vector> <string> <memory>)
target_link_libraries(saccade_pch_rpc PRIVATE gRPC::grpc++)
target_precompile_headers(saccade_pch_rpc PRIVATE <grpcpp/grpcpp.h> <memory> <string>)

if(SACCADE_TESTS)
  find_package(GTest REQUIRED)
  foreach(kind eigen vision)
    add_library(saccade_pch_test_${kind} STATIC ${CMAKE_BINARY_DIR}/pch.cpp)
    target_link_libraries(saccade_pch_test_${kind} PRIVATE
      saccade_build_options Eigen3::Eigen GTest::gmock GTest::gtest_main)
    target_precompile_headers(saccade_pch_test_${kind} PRIVATE
      <gmock/gmock.h> <gtest/gtest.h> <vector> <string> <memory>)
  endforeach()
  target_precompile_headers(saccade_pch_test_eigen PRIVATE <Eigen/Dense>)
  target_link_libraries(saccade_pch_test_vision PRIVATE OpenCV::core OpenCV::imgproc)
  target_precompile_headers(saccade_pch_test_vision PRIVATE
    <Eigen/Dense> <opencv2/core.hpp> <opencv2/imgproc.hpp>)
endif()
