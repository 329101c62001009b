#include "meshing/tetrahedra/gmsh_session.h"

#include <gmsh.h>

namespace palpate {

GmshSession::GmshSession(const std::vector<std::string>& assignments) {
  std::vector<std::string> words = {"gmsh"};
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    words.insert(words.end(), {"-setnumber", assignment.substr(0, equals), assignment.substr(equals + 1)});
  }
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  gmsh::initialize(static_cast<int>(argv.size()), argv.data(), /*readConfigFiles=*/false);
  gmsh::option::setNumber("General.Terminal", 0);
  gmsh::option::setNumber("General.NumThreads", 1);
  gmsh::option::setNumber("Mesh.RandomSeed", 1);
  gmsh::option::setNumber("Mesh.Renumber", 0);  // nodes keep their tags
  gmsh::logger::start();
}

GmshSession::~GmshSession() {
  try {
    gmsh::finalize();
  } catch (...) {  // gmsh throws std::string; a destructor must not throw
  }
}

void GmshSession::use_hxt(double size, double optimize_below) {
  gmsh::option::setNumber("Mesh.Algorithm3D", 10);
  gmsh::option::setNumber("Mesh.Optimize", optimize_below > 0 ? 1 : 0);
  gmsh::option::setNumber("Mesh.OptimizeThreshold", optimize_below);
  gmsh::option::setNumber("Mesh.MeshSizeExtendFromBoundary",
                          1);  // without it HXT is slower and makes slivers where edge lengths differ
  if (size > 0) gmsh::option::setNumber("Mesh.MeshSizeMax", size);
}

void GmshSession::generate(int dimension) {
  try {
    gmsh::model::mesh::generate(dimension);
  } catch (const std::string& error) {
    std::string reason = error;
    std::vector<std::string> log;
    gmsh::logger::get(log);
    for (const std::string& line : log)
      if (line.rfind("Error", 0) == 0) {
        reason = line.rfind("Error: ", 0) == 0 ? line.substr(7) : line;
        break;
      }
    GmshFailure failure(reason);
    gmsh::vectorpair entities;
    gmsh::model::mesh::getLastNodeError(failure.nodes);
    gmsh::model::mesh::getLastEntityError(entities);
    for (const auto& [entity_dimension, tag] : entities)
      if (entity_dimension == 2) failure.surfaces.push_back(tag);
    throw failure;
  }
}

}  // namespace palpate
