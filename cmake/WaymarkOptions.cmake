# SPDX-License-Identifier: Apache-2.0
# Rules that hold for all of our code.
option(WM_TESTS "Build the tests" ON)
option(WM_FUZZ "Build the fuzz targets (clang)" OFF)
option(WM_RENDER "Build what renders pictures of worlds (with Embree): waymark-simulate, its tests and benchmarks" ON)
option(WM_UNITY "Compile the desk's sources in batches: half of their time is the same headers. OFF for editors that need each source's own command" ON)
option(WM_REPRODUCIBLE "Programs without the paths of this computer: the same bytes from the same sources in any folder; packages are built so" OFF)
set(WM_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=")

set(WM_WARNINGS -Wall -Wextra -Wshadow
  $<$<C_COMPILER_ID:GNU>:-Wdouble-promotion> # clang has it about NAN and INFINITY, too
  -Wvla -Wundef -Werror
  $<$<C_COMPILER_ID:GNU>:-Wno-format-truncation>) # messages are cut at the end of their buffer on purpose

# Debug information has lines, but no variables (-g1): backtraces and profiles need no more, and -g makes the programs of
# the tests ten times as large (5 GB).
set(CMAKE_C_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1 -DNDEBUG")

# Under sanitizers optimised a little only: -O2 takes three times as long to compile, and the tests run as well.
# What the optimiser warns about then is often untrue; the release build has warnings as errors.
set(CMAKE_C_FLAGS_SANITIZED "-O1 -g1 -DNDEBUG -w")
set(CMAKE_CXX_FLAGS_SANITIZED "-O1 -g1 -DNDEBUG -w")

add_library(wm_rules INTERFACE)
target_compile_options(wm_rules INTERFACE
  ${WM_WARNINGS}
  $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes -Wmissing-prototypes>
  $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor>
  # The same bits on every machine: no fused multiply-add, no reordering (docs/design.md, numbers).
  -ffp-contract=off -fno-fast-math
  -fno-omit-frame-pointer)
set(WM_PREFIX_MAP "") # also for sources that are generated, which have no wm_rules
if(WM_REPRODUCIBLE) # the last one that fits is taken: a build folder below the sources has one name, whatever its own is
  set(WM_PREFIX_MAP -ffile-prefix-map=${CMAKE_SOURCE_DIR}=. -ffile-prefix-map=${CMAKE_BINARY_DIR}=./build)
endif()
target_compile_options(wm_rules INTERFACE ${WM_PREFIX_MAP})
# As Debian builds its packages (dpkg-buildflags, hardening=+all). All programs: addresses are resolved and read-only before
# they begin; the robot's rooms, also checked copies and canaries on the stack (of code with the property WM_HARDENED). Sanitizers
# bring their own checks. tests/package/hardening.py looks for it in the programs.
if(NOT WM_SANITIZE)
  set(hardened $<BOOL:$<TARGET_PROPERTY:WM_HARDENED>>)
  set(checked $<AND:${hardened},$<NOT:$<CONFIG:Debug>>>) # without an optimizer nothing is checked, and a warning says so
  target_compile_options(wm_rules INTERFACE $<${hardened}:-fstack-protector-strong>)
  # -U: a compiler may have set another level.
  target_compile_options(wm_rules INTERFACE $<${checked}:-U_FORTIFY_SOURCE> $<${checked}:-D_FORTIFY_SOURCE=3>)
  target_link_options(wm_rules INTERFACE -Wl,-z,relro,-z,now)
endif()
target_compile_definitions(wm_rules INTERFACE _GNU_SOURCE EIGEN_DONT_VECTORIZE EIGEN_MPL2_ONLY
  # On 32 bits, too: recordings of more than 2 GB, and folders whose places need 64 bits.
  $<$<EQUAL:${CMAKE_SIZEOF_VOID_P},4>:_FILE_OFFSET_BITS=64>)
# WM_VERSION, in a header of its own: a new version compiles anew only what names it.
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/wm_version.h CONTENT "#pragma once\n#define WM_VERSION \"@PROJECT_VERSION@\"\n" @ONLY)
target_include_directories(wm_rules INTERFACE ${CMAKE_BINARY_DIR}/generated)
if(WM_SANITIZE)
  target_compile_options(wm_rules INTERFACE -fsanitize=${WM_SANITIZE} -fno-sanitize-recover=all)
  target_link_options(wm_rules INTERFACE -fsanitize=${WM_SANITIZE})
endif()
if(WM_FUZZ)
  target_compile_options(wm_rules INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Of the desk's rooms, which call it: several sources are one for the compiler. So names in their unnamed namespaces differ within a
# library. The robot's rooms stay as they are: their objects are the same in every build.
macro(wm_desk_room)
  set(CMAKE_UNITY_BUILD ${WM_UNITY})
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 6) # larger ones take a compiler longer than any other file
endmacro()

# wm_library(NAME SOURCES a.c b.cpp [USES lib ...]): a library with the rules; USES is public, and is the whole list of what
# it may include.
function(wm_library name)
  cmake_parse_arguments(A "" "" "SOURCES;USES;PRIVATE_USES" ${ARGN})
  add_library(${name} STATIC ${A_SOURCES})
  target_link_libraries(${name} PUBLIC ${A_USES} PRIVATE wm_rules ${A_PRIVATE_USES})
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "^${CMAKE_SOURCE_DIR}/(msgs|estimator|drivers|firmware)(/|$)")
    set_target_properties(${name} PROPERTIES WM_HARDENED ON)
  endif()
endfunction()

# What runs under the thread sanitizer: the tests with the label "threads".
add_custom_target(wm_thread_tests)

# Seconds in `variable`: as given, or the usual; ten times that where tests run in an emulator, five times where lines are counted
# or under a sanitizer.
macro(wm_timeout variable usual)
  if(NOT ${variable})
    set(${variable} ${usual})
  endif()
  if(CMAKE_CROSSCOMPILING)
    math(EXPR ${variable} "${${variable}} * 10")
  elseif(WM_SANITIZE OR CMAKE_CXX_FLAGS MATCHES "--coverage")
    math(EXPR ${variable} "${${variable}} * 5")
  endif()
endmacro()

# Of the slots that ctest -j has, a test that computes takes two, and one that mostly waits (WAITS: a daemon at real rate, a disk
# that blocks) one. With two slots a processor (./dev), as many tests compute at once as there are processors, and others wait beside them.
# COST: seconds of the longest, which ctest begins first; it learns others itself.
macro(wm_slots name)
  set(slots 2)
  if(A_WAITS AND NOT CMAKE_CROSSCOMPILING) # an emulator computes all the time
    set(slots 1)
  endif()
  set_tests_properties(${name} PROPERTIES PROCESSORS ${slots})
  if(A_COST)
    set_tests_properties(${name} PROPERTIES COST ${A_COST})
  endif()
endmacro()

# What each test finds in its environment. In an emulator, tests of many random trials take an eighth of them (tests/common/trials.h).
set(WM_TEST_ENVIRONMENT "WM_SOURCE_DIR=${CMAKE_SOURCE_DIR};WM_BIN_DIR=${CMAKE_BINARY_DIR}/bin;WM_DATA_DIR=${CMAKE_SOURCE_DIR}/../shared/data")
if(CMAKE_CROSSCOMPILING)
  list(APPEND WM_TEST_ENVIRONMENT WM_FEWER=8)
endif()

# wm_test(NAME SOURCES x.c USES lib ... [LABELS slow] [TIMEOUT s] [COST s] [WAITS]): a Unity test program, run by ctest.
# Label "slow" keeps it out of `./dev test` and in `./dev test --all`. A test gets the repository's root in WM_SOURCE_DIR and the
# folder of the optional recordings in WM_DATA_DIR.
function(wm_test name)
  cmake_parse_arguments(A "WAITS" "TIMEOUT;COST" "SOURCES;USES;LABELS;ARGS" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE ${A_USES} wm_unity wm_rules m)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
  add_test(NAME ${name} COMMAND ${name} ${A_ARGS} WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  wm_timeout(A_TIMEOUT 120)
  if("threads" IN_LIST A_LABELS)
    add_dependencies(wm_thread_tests ${name})
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}" SKIP_RETURN_CODE 77
    ENVIRONMENT "${WM_TEST_ENVIRONMENT}")
  wm_slots(${name})
endfunction()

# wm_script_test(NAME COMMAND ... [LABELS slow] [TIMEOUT s] [COST s] [WAITS]): a test that is a script; exit code 77 means skipped.
function(wm_script_test name)
  cmake_parse_arguments(A "WAITS" "TIMEOUT;COST" "COMMAND;LABELS" ${ARGN})
  add_test(NAME ${name} COMMAND ${A_COMMAND} WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  wm_timeout(A_TIMEOUT 300)
  set_tests_properties(${name} PROPERTIES TIMEOUT ${A_TIMEOUT} LABELS "${A_LABELS}" SKIP_RETURN_CODE 77
    ENVIRONMENT "${WM_TEST_ENVIRONMENT}")
  wm_slots(${name})
endfunction()

# wm_fuzz(NAME SOURCES x.c USES lib ... [CORPUS dir]): a libFuzzer target; with WM_FUZZ only.
function(wm_fuzz name)
  if(NOT WM_FUZZ)
    return()
  endif()
  cmake_parse_arguments(A "" "" "SOURCES;USES" ${ARGN})
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE ${A_USES} wm_rules m)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz)
endfunction()
