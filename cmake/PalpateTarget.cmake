# What every target of ours gets; nothing here touches a host's own targets.

if(PROJECT_IS_TOP_LEVEL)
  if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
  endif()
  find_program(PALPATE_CCACHE ccache)
  if(PALPATE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    set(CMAKE_C_COMPILER_LAUNCHER ${PALPATE_CCACHE})
    set(CMAKE_CXX_COMPILER_LAUNCHER ${PALPATE_CCACHE})
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

# palpate_room(NAME SOURCES ... [USES ...] [PRIVATE ...]): the static library of one folder. USES: the rooms and libraries that its
# headers and sources may use; PRIVATE: those that its sources alone may use. Where tests are built, NAME_links links the
# whole room with what it states and nothing else: the link fails where a room calls another that it does not state.
function(palpate_room name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES;PRIVATE" ${ARGN})
  palpate_library(${name} ${ARG_SOURCES})
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
