# Third-party libraries of the offline half. Folder CMakeLists link what they need and nothing else.
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
# What the headers of formats bring along; their targets must be known in every folder that links palpate_formats.
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(tomlplusplus REQUIRED)
