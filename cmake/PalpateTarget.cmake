# What every target of ours gets; nothing here touches a host's own targets.

if(PROJECT_IS_TOP_LEVEL)
  if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
  endif()
  find_program(PALPATE_CCACHE ccache)
  if(PALPATE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # Paths below the project are hashed relative to the build folder: clones in different folders share what was compiled.
    set(palpate_ccache CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1)
    set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${palpate_ccache} ${PALPATE_CCACHE})
    # ccache keeps what a precompiled header went into only when it is told so. No source of ours uses __TIME__ or __DATE__.
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env ${palpate_ccache} CCACHE_SLOPPINESS=pch_defines,time_macros ${PALPATE_CCACHE})
  endif()
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
endif()

# palpate_target(NAME): C++20, warnings, sanitizers, includes relative to the repository root ("formats/...").
function(palpate_target name)
  target_compile_features(${name} PRIVATE cxx_std_20)
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_compile_definitions(${name} PRIVATE PALPATE_VERSION="${PROJECT_VERSION}")
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor>
                                           $<$<BOOL:${PALPATE_WARNINGS_AS_ERRORS}>:-Werror>)
    if(PALPATE_SANITIZE)
      # A finding ends the program, so that a test with one does not pass.
      target_compile_options(${name} PRIVATE -fsanitize=${PALPATE_SANITIZE} -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
      target_link_options(${name} PUBLIC -fsanitize=${PALPATE_SANITIZE})
    endif()
  endif()
endfunction()

# palpate_library(NAME SOURCES... ) and palpate_program(NAME SOURCES...): a static library or a program with those settings.
function(palpate_library name)
  add_library(${name} STATIC ${ARGN})
  palpate_target(${name})
endfunction()
function(palpate_program name)
  add_executable(${name} ${ARGN})
  palpate_target(${name})
endfunction()

# palpate_precompiled(NAME [HEADERS...]): a library without objects, whose precompiled header holds the standard headers, fmt and
# HEADERS. palpate_use_precompiled(TARGET NAME): every C++ source of TARGET includes it first. Parsing these headers is most of
# what a small source takes to compile. A source still includes what it uses: the presets sanitize and fuzz build without.
function(palpate_precompiled name)
  file(WRITE ${PROJECT_BINARY_DIR}/${name}.cpp "")
  palpate_library(${name} ${PROJECT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE fmt::fmt)
  target_precompile_headers(${name} PRIVATE
    <algorithm> <array> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional> <limits> <map> <memory> <numeric>
    <optional> <set> <span> <string> <thread> <utility> <vector> <fmt/format.h> ${ARGN})
endfunction()
function(palpate_use_precompiled target name)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "EXECUTABLE")  # g++ takes a precompiled header only with the same -fPIC
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${target} PRIVATE -fPIC)
  endif()
  target_precompile_headers(${target} REUSE_FROM ${name})
endfunction()

# palpate_orchestrates(TARGET): for targets that parse, check and report. -O1 compiles them in two thirds of the time of -O3, and
# no measured time is spent in them.
function(palpate_orchestrates target)
  if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")  # collects its garbage seldom: a tenth of the time for a sixth more memory
    target_compile_options(${target} PRIVATE "SHELL:--param ggc-min-expand=300 --param ggc-min-heapsize=1048576")
  endif()
endfunction()

# palpate_room(NAME SOURCES ... [USES ...] [PRIVATE ...]): the static library of one folder. USES: the rooms and libraries that its
# headers and sources may use; PRIVATE: those that its sources alone may use. Where tests are built, NAME_links links the
# whole room with what it states and nothing else: the link fails where a room calls another that it does not state.
# ORCHESTRATES: see palpate_orchestrates. PLAIN: no precompiled header, for rooms with compiler flags of their own.
function(palpate_room name)
  cmake_parse_arguments(ARG "ORCHESTRATES;PLAIN" "" "SOURCES;USES;PRIVATE" ${ARGN})
  palpate_library(${name} ${ARG_SOURCES})
  if(TARGET palpate_precompiled_common AND NOT ARG_PLAIN)
    palpate_use_precompiled(${name} palpate_precompiled_common)
  endif()
  if(ARG_ORCHESTRATES)
    palpate_orchestrates(${name})
  endif()
  target_link_libraries(${name} PUBLIC ${ARG_USES} PRIVATE ${ARG_PRIVATE})
  if(PALPATE_BUILD_TESTS AND NOT PALPATE_SANITIZE)
    set(main ${PROJECT_BINARY_DIR}/room_links.cpp)
    if(NOT EXISTS ${main})
      file(WRITE ${main} "int main() {}\n")
    endif()
    palpate_program(${name}_links ${main})
    target_link_libraries(${name}_links PRIVATE $<LINK_LIBRARY:WHOLE_ARCHIVE,${name}>)
    set_target_properties(${name}_links PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests/rooms)
  endif()
endfunction()
