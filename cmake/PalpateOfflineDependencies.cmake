# Third-party libraries of the offline half. Folder CMakeLists link what they need and nothing else.
find_package(PkgConfig REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Threads REQUIRED)
