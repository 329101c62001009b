# The WebAssembly builds of the runtime from the host's build: target web_runtime makes web/{simd,baseline}/palpate.wasm with
# Debian's emscripten, each configured in a folder of its own.
find_program(PALPATE_EMCMAKE emcmake)
find_program(PALPATE_NODE node)
option(PALPATE_BUILD_WEB "Build the runtime for browsers where emscripten and node are there" ON)
if(PALPATE_BUILD_WEB AND NOT (PALPATE_EMCMAKE AND PALPATE_NODE))
  message(STATUS "No WebAssembly build of the runtime and none of its tests: emscripten or node is missing")
  set(PALPATE_BUILD_WEB OFF)
endif()
if(NOT PALPATE_BUILD_WEB)
  return()
endif()

set(PALPATE_WEB_MODULES)
set(PALPATE_WEB_FOLDER ${PROJECT_BINARY_DIR}/web)
foreach(variant IN ITEMS simd baseline)
  string(COMPARE EQUAL ${variant} simd simd)
  set(folder ${PALPATE_WEB_FOLDER}/${variant})
  list(APPEND build_commands
       COMMAND ${PALPATE_EMCMAKE} ${CMAKE_COMMAND} -S ${PROJECT_SOURCE_DIR} -B ${folder} -G Ninja --log-level=WARNING
               -DCMAKE_BUILD_TYPE=Release -DPALPATE_BUILD_OFFLINE=OFF -DPALPATE_BUILD_TESTS=OFF -DPALPATE_WEB_SIMD=${simd}
               -DPALPATE_WARNINGS_AS_ERRORS=${PALPATE_WARNINGS_AS_ERRORS} > ${PALPATE_WEB_FOLDER}/configure.log
       COMMAND ${CMAKE_COMMAND} --build ${folder} --parallel 2 --target palpate_web)
  list(APPEND PALPATE_WEB_MODULES ${folder}/palpate.wasm)
endforeach()
file(MAKE_DIRECTORY ${PALPATE_WEB_FOLDER})
# web/core/palpate.wasm: the core alone, built to be small.
set(folder ${PALPATE_WEB_FOLDER}/core)
add_custom_target(web_core
  COMMAND ${PALPATE_EMCMAKE} ${CMAKE_COMMAND} -S ${PROJECT_SOURCE_DIR} -B ${folder} -G Ninja --log-level=WARNING
          -DCMAKE_BUILD_TYPE=MinSizeRel -DPALPATE_BUILD_OFFLINE=OFF -DPALPATE_BUILD_TESTS=OFF -DPALPATE_WEB_CORE=ON
          -DPALPATE_WARNINGS_AS_ERRORS=${PALPATE_WARNINGS_AS_ERRORS} > ${PALPATE_WEB_FOLDER}/configure_core.log
  COMMAND ${CMAKE_COMMAND} --build ${folder} --parallel 2 --target palpate_web
  COMMENT "Building the runtime's core for browsers" VERBATIM)
add_custom_target(web_runtime ALL ${build_commands} COMMENT "Building the runtime for browsers" VERBATIM)
