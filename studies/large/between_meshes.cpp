// The same push on every mesh. Its force depends on the element, on how well the mesh resolves the disc's pressure, and on the shape of
// the mesh. The study varies one of the three at a time: the element; the disc, with and without the compliance that the mesh cannot
// resolve; the coarsest mesh with each tetrahedron cut into eight, which keeps its shape at twice the resolution.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "formats/program.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/large/played.h"
#include "studies/large/split_mesh.h"
#include "studies/large/study.h"
#include "studies/large/study_folder.h"
#include "studies/timing/timing.h"

namespace palpate::large {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr int kSamples = 1;
// Differences between meshes are per cents.
constexpr double kConverged = 1e-5;
// Newton's method follows the push in such moves; from longer ones its line search starts with inverted tetrahedra.
constexpr double kMove = 0.005;  // m

Vector3d eigen(Vec3 v) {
  return {v.x, v.y, v.z};
}
// Empty cells where there is no force.
void put(Json* row, const std::string& name, const Vector3d* force) {
  for (Index i = 0; i < 3; ++i) (*row)[fmt::format("{}_{}_N", name, "xyz"[i])] = force ? Json((*force)[i]) : Json();
}

// The forces at each depth, N on the organ; empty from where no solution is found.
std::vector<Vector3d> follow(const LargeReference& body, const MatrixXd& rows, const MatrixXd& compliance,
                             const Vector3d& way, const std::vector<double>& depths) {
  std::vector<Vector3d> forces;
  VectorXd u = VectorXd::Zero(body.dofs());
  double reached = 0;
  try {
    for (const double depth : depths) {
      const int moves = std::max(1, static_cast<int>(std::ceil((depth - reached) / kMove - 1e-9)));
      VectorXd force;
      for (int i = 1; i <= moves; ++i)
        force = body.solve(rows, (reached + (depth - reached) * i / moves) * way, &u, kConverged, compliance);
      forces.emplace_back(force);
      reached = depth;
    }
  } catch (const std::runtime_error& error) {
    note(fmt::format("no converged solution beyond {:g} mm: {}", 1e3 * reached, error.what()));
  }
  return forces;
}

class Between {
 public:
  explicit Between(const LargeStudyOptions& options)
      : options_(options),
        organ_(options.organ),
        folder_(organ_),
        sites_(accuracy::choose_sites(organ_.body(organ_.resolutions().back()), 1e-3 * options.organ.radius_mm,
                                      options.organ.sites, kSamples)) {
    for (const double depth : options.depths_mm) depths_.push_back(1e-3 * depth);
  }

  void run() {
    const auto begun = studies::Clock::now();
    std::vector<std::pair<std::string, std::filesystem::path>> meshes = {
        {organ_.resolutions().front() + "-split", split(organ_.resolutions().front())}};
    for (const auto& resolution : organ_.resolutions()) meshes.emplace_back(resolution, organ_.make_mesh(resolution));
    std::vector<Json> rows;
    Json study = {{"places", sites_.touch.size()}, {"meshes", Json::array()}};
    Progress progress("study", meshes.size() * options_.poisson.size() * std::size(kElements));
    for (const auto& [name, mesh] : meshes)
      for (const double poisson : options_.poisson)
        for (const char* element : kElements) {
          Json point = this->point(name, mesh, element, poisson);
          for (const auto& row : point.at("rows")) rows.push_back(row);
          point.erase("rows");
          study["meshes"].push_back(point);
          progress.advance();
        }
    study["took_s"] = studies::seconds_since(begun);
    folder_.write("between-meshes", study, rows, "between_meshes.py", "between-meshes.html");
  }

 private:
  static constexpr const char* kElements[] = {"p1", "p1-anp", "p2-p0"};

  std::filesystem::path split(const std::string& resolution) const {
    const auto file = folder_.path() / "meshes" / (resolution + "-split.msh");
    std::filesystem::create_directories(file.parent_path());
    write_mesh(file, split_mesh(read_mesh(organ_.make_mesh(resolution))));
    return file;
  }

  Json point(const std::string& name, const std::filesystem::path& mesh, const std::string& element,
             double poisson) const {
    const auto organ_file = organ_.organ_file(element, poisson);
    const Json settings = {
        {"between_meshes", kVersion}, {"depths", options_.depths_mm}, {"sites", accuracy::json_of(sites_)}};
    return folder_.kept_or_measured({mesh, organ_file}, settings, [&](const std::filesystem::path&) {
      say(fmt::format("measuring {}, {}, nu {:g}", name, element, poisson));
      // The large deformation has no quadratic elements.
      const bool large = element != "p2-p0";
      const auto file = folder_.bake(mesh, organ_file, fmt::format("{}-{}-nu-{}", name, element, poisson), false);
      const LargeBody body = folder_.body(mesh, organ_file);
      Json measured = {
          {"mesh", name}, {"element", element}, {"poisson", poisson}, {"vertices", body.elastic().nodes.size()}};
      std::vector<Json> rows;
      const Bundle bundle(file.c_str());
      Player linear(bundle, PALPATE_DEFORMATION_LINEAR, sites_.radius);
      const std::unique_ptr<LargeReference> reference(large ? new LargeReference(body.get()) : nullptr);
      for (std::size_t place = 0; place < sites_.touch.size(); ++place)
        for (const Json& row : pushes(linear, reference.get(), sites_.touch[place])) {
          rows.push_back(measured);
          rows.back()["place"] = place;
          rows.back().update(row);
        }
      measured["rows"] = rows;
      return measured;
    });
  }

  // One row for each depth: forces in N. plain: without the compliance that the disc has beyond the mesh.
  std::vector<Json> pushes(Player& linear, const LargeReference* reference, const accuracy::TouchSite& site) const {
    const HeldDisc disc = linear.hold(site.at);
    const Vector3d way = eigen(site.inward);
    const Eigen::Matrix3d plain_stiffness = (disc.stiffness.inverse() - disc.compliance).inverse();
    std::vector<Vector3d> large, plain_large;
    if (reference) {
      MatrixXd rows = MatrixXd::Zero(3, reference->dofs());
      for (std::size_t n = 0; n < disc.nodes.size(); ++n)
        for (Index i = 0; i < 3; ++i) rows(i, 3 * disc.nodes[n] + i) = disc.weights[n];
      large = follow(*reference, rows, disc.compliance, way, depths_);
      plain_large = follow(*reference, rows, {}, way, depths_);
    }
    std::vector<Json> rows;
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      Json row = {{"depth_mm", 1e3 * depths_[i]}, {"disc_nodes", disc.nodes.size()}};
      const Vector3d linear_force = depths_[i] * disc.stiffness * way, plain_force = depths_[i] * plain_stiffness * way;
      put(&row, "linear", &linear_force), put(&row, "linear_plain", &plain_force);
      put(&row, "large", i < large.size() ? &large[i] : nullptr);
      put(&row, "large_plain", i < plain_large.size() ? &plain_large[i] : nullptr);
      rows.push_back(row);
    }
    return rows;
  }

  const LargeStudyOptions options_;
  const accuracy::OrganCase organ_;
  const StudyFolder folder_;
  const accuracy::StudySites sites_;
  std::vector<double> depths_;
};

}  // namespace

void run_study_between_meshes(const LargeStudyOptions& options) {
  Between(with_defaults(options)).run();
}

}  // namespace palpate::large
