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

set(PALPATE_WEB_FOLDER ${PROJECT_BINARY_DIR}/web)
file(MAKE_DIRECTORY ${PALPATE_WEB_FOLDER})
# palpate_web_commands(COMMANDS VARIANT OPTIONS...): appends to COMMANDS what makes web/VARIANT/palpate.wasm.
macro(palpate_web_commands commands variant)
  list(APPEND ${commands}
       COMMAND ${PALPATE_EMCMAKE} ${CMAKE_COMMAND} -S ${PROJECT_SOURCE_DIR} -B ${PALPATE_WEB_FOLDER}/${variant} -G Ninja --log-level=WARNING
               -DPALPATE_BUILD_OFFLINE=OFF -DPALPATE_BUILD_TESTS=OFF -DPALPATE_WARNINGS_AS_ERRORS=${PALPATE_WARNINGS_AS_ERRORS} ${ARGN}
               > ${PALPATE_WEB_FOLDER}/configure_${variant}.log
       COMMAND ${CMAKE_COMMAND} --build ${PALPATE_WEB_FOLDER}/${variant} --parallel 2 --target palpate_web)
endmacro()
palpate_web_commands(of_runtime simd -DCMAKE_BUILD_TYPE=Release -DPALPATE_WEB_SIMD=1)
palpate_web_commands(of_runtime baseline -DCMAKE_BUILD_TYPE=Release -DPALPATE_WEB_SIMD=0)
set(PALPATE_WEB_MODULES ${PALPATE_WEB_FOLDER}/simd/palpate.wasm ${PALPATE_WEB_FOLDER}/baseline/palpate.wasm)
add_custom_target(web_runtime ALL ${of_runtime} COMMENT "Building the runtime for browsers" VERBATIM)
# The core alone, built to be small.
palpate_web_commands(of_core core -DCMAKE_BUILD_TYPE=MinSizeRel -DPALPATE_WEB_CORE=ON "-DCMAKE_CXX_FLAGS_MINSIZEREL=-Os -flto -DNDEBUG")
add_custom_target(web_core ${of_core} COMMENT "Building the runtime's core for browsers" VERBATIM)
