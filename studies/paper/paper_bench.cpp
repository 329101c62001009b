// Repeats one of the paper's measurements on a mesh or a bundle and prints JSON (paper_measurements.h). study.py runs it.
//
//   paper_bench columns MESH.msh --organ organ.toml --boundary bc.toml
//   paper_bench moves MESH.msh --organ organ.toml --boundary bc.toml --bundle BUNDLE.h5
//   paper_bench superposition BUNDLE.h5 --at X Y Z --at X Y Z --by X Y Z
#include <CLI/CLI.hpp>

#include "formats/command_line.h"
#include "formats/errors.h"
#include "precompute/run/run_summary.h"
#include "precompute/solver/petsc_session.h"
#include "studies/paper/paper_measurements.h"

namespace palpate::studies {
namespace {

struct Options {
  std::string input, organ, boundary, bundle, json = "-";
  std::vector<double> at, by = {0, 0, -0.005};
  double seconds = 10;
};

Push push_of(const Options& o) {
  const OrganConfig organ = read_organ_config(o.organ);
  return make_push(
      make_elastic_body(read_mesh(o.input), organ, read_boundary_config(o.boundary), {o.input, o.organ, o.boundary}),
      organ.element);
}

std::vector<Eigen::Vector3d> points_of(const std::vector<double>& numbers) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i + 3 <= numbers.size(); i += 3) points.emplace_back(&numbers[i]);
  return points;
}

int run(int argc, char** argv) {
  Options o;
  CLI::App *columns = nullptr, *moves = nullptr, *superposition = nullptr;
  const auto on_mesh = [&](CLI::App* command) {
    command->add_option("MESH.msh", o.input)->required();
    command->add_option("--organ", o.organ, "organ.toml with an element on the mesh's own nodes")->required();
    command->add_option("--boundary", o.boundary, "its boundary set")->required();
    command->add_option("--seconds", o.seconds, "most time per row, s")->check(CLI::Range(0.01, 3600.0));
    return command;
  };
  return run_program(
      argc, argv, "paper_bench", "Repeats the measurements of Cotin, Delingette and Ayache 1999.",
      [&](CLI::App& app) {
        app.add_option("--json", o.json, "file for the result; - is standard output");
        app.require_subcommand(1);
        columns = on_mesh(app.add_subcommand("columns", "the preprocessing: a constrained solve for each column"));
        moves = on_mesh(app.add_subcommand("moves", "table 1 and the collision rates"));
        moves->add_option("--bundle", o.bundle, "computed from this mesh")->required();
        superposition =
            app.add_subcommand("superposition", "compares several contacts together with the sum of each alone");
        superposition->add_option("BUNDLE.h5", o.input)->required();
        superposition->add_option("--at", o.at, "X Y Z, m; twice or more")->required()->expected(6, 300);
        superposition->add_option("--by", o.by, "X Y Z, m: the displacement imposed")->expected(3);
      },
      [&] {
        if (superposition->parsed())
          return write_json(measure_superposition(o.input, points_of(o.at), Eigen::Vector3d(o.by.data())), o.json);
        const PetscSession session({});
        const Push push = push_of(o);
        if (columns->parsed()) return write_json(measure_columns(push, o.seconds), o.json);
        write_json(measure_moves(push, Correction(read_organ_config(o.organ)), o.bundle, o.seconds), o.json);
      });
}

}  // namespace
}  // namespace palpate::studies

int main(int argc, char** argv) {
  return palpate::studies::run(argc, argv);
}
