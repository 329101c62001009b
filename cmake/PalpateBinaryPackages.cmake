# The Debian packages that `cpack` makes: the shared library, what a host compiles with, and the programs. Only a build with
# -DBUILD_SHARED_LIBS=ON -DCMAKE_INSTALL_PREFIX=/usr has all three.
get_target_property(abi palpate SOVERSION)
set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL runtime development programs)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "Palpate maintainers")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/runtime)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libpalpate${abi})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
    "touch an organ in real time: the library\n A program maps a tensor bundle and gets the forces on its tools and the deformed shape.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libpalpate-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libpalpate${abi} (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "touch an organ in real time: headers\n Headers in C and C++, and the files for CMake and pkg-config.")

set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME palpate)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "libpalpate${abi} (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION
    "bakes the elastic response of an organ and plays touches\n From a label image or a surface to tetrahedra, to a tensor bundle, and to forces and shapes.")
include(CPack)
