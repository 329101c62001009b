#include "studies/accuracy/study_plan.h"

#include <algorithm>
#include <cmath>

namespace palpate::accuracy {
namespace {

class Plan {
 public:
  Plan(const OrganCase& organ, int crowd, const std::vector<std::string>& references)
      : organ_(organ), crowd_(crowd), references_(references) {}

  std::vector<PlannedPoint> all() {
    add_references(plain(""));
    if (has("mesh")) mesh_and_element(), contact_models();
    if (has("scenes")) scenes();
    if (has("storage")) storage();
    if (has("tolerance")) tolerance();
    if (has("poisson")) poisson();
    return std::move(points_);
  }

 private:
  bool has(const char* axis) const { return organ_.options().has_axis(axis); }

  Setting plain(const std::string& resolution) const {
    Setting s;
    s.bundle.resolution = resolution;
    s.bundle.element = organ_.element();
    return s;
  }

  void add(const Setting& setting, const std::string& axis) {
    const std::string text = text_of(setting);
    const auto known =
        std::find_if(points_.begin(), points_.end(), [&](const PlannedPoint& p) { return text_of(p.setting) == text; });
    if (known != points_.end())
      known->axes.insert(axis);
    else
      points_.push_back({setting, {axis}});
  }

  // The references of the setting's situation, and the coarser meshes that their errors are estimated from.
  void add_references(Setting setting) {
    setting.scene = best_scene(setting.scene);
    const auto& all = organ_.resolutions();
    for (const auto& element : references_)
      for (auto r = all.rbegin(); r != all.rend(); ++r) {
        setting.bundle.element = element, setting.bundle.resolution = *r;
        add(setting, "reference");
      }
  }

  void mesh_and_element() {
    for (const char* element : {"p2-p0", "p1", "p1-anp"})
      for (const auto& resolution : organ_.resolutions()) {
        Setting s = plain(resolution);
        s.bundle.element = element;
        add(s, "mesh");
      }
  }

  void contact_models() {
    for (const char* contact : {"node", "triangle", "point", "patch"})
      for (const auto& resolution : organ_.resolutions()) {
        Setting s = plain(resolution);
        s.scene.contact = contact;
        add(s, "contact");
      }
  }

  void scenes() {
    for (const char* law : {"sticking", "sliding", "unilateral", "coulomb"})
      for (const char* surface : {"mesh", "fine"})
        add_scene("law", [&](SceneSetting& s) {
          s.exercise = "drag", s.law = law, s.surface = surface;
          if (s.surface == "fine") s.collision = "deformed";
        });
    for (const int contacts : {1, 2, 3, 6, 10, 30, 100})
      if (contacts <= std::max(organ_.options().sites, crowd_))
        add_scene("contacts", [&](SceneSetting& s) { s.contacts = contacts; });
    for (const char* collision : {"rest", "deformed"})
      add_scene("collision", [&](SceneSetting& s) { s.exercise = "neighbour", s.collision = collision; });
    if (organ_.has_response())
      for (const bool response : {false, true})
        add_scene("response", [&](SceneSetting& s) { s.exercise = "measured", s.response = response; });
    for (const bool relaxation : {false, true})
      add_scene("relaxation", [&](SceneSetting& s) { s.exercise = "hold", s.relaxation = relaxation; });
  }

  template <class Change>
  void add_scene(const char* axis, Change change) {
    Setting s = plain(organ_.base_resolution());
    change(s.scene);
    add_references(s);
    add(s, axis);
  }

  void storage() {
    for (const auto& resolution : organ_.resolutions()) {
      const bool ends = resolution == organ_.base_resolution() || resolution == organ_.resolutions().back();
      for (const char* storage : {"f64", "f32", "f16", "low-rank 1e-2", "low-rank 1e-3", "low-rank 1e-4"}) {
        Setting s = plain(resolution);
        s.bundle.storage = storage;
        const std::string name = storage;
        if (name == "f64" && resolution != organ_.base_resolution())
          continue;  // twice the bytes of f32: one mesh is enough to show it
        if ((name == "low-rank 1e-2" || name == "low-rank 1e-4") && !ends) continue;
        add(s, "storage");
      }
    }
  }

  // With the Cholesky factor every tolerance is met at once, so multigrid is measured as well. Stored as f64, because f32
  // would hide differences of 1e-8.
  void tolerance() {
    for (const char* solver : {"auto", "multigrid"})
      for (int digits = 2; digits <= 12; digits += solver[0] == 'a' ? 10 : 2) {
        Setting s = plain(organ_.base_resolution());
        s.bundle.storage = "f64", s.bundle.solver = solver, s.bundle.tolerance = std::pow(10.0, -digits);
        add(s, "tolerance");
      }
  }

  void poisson() {
    for (const double nu : {0.3, 0.45, 0.49, 0.499}) {
      Setting s = plain("");
      if (nu != organ_.poisson()) s.bundle.poisson = nu, s.bundle.everywhere = false;
      add_references(s);
      for (const char* element : {"p1", "p1-anp", "p2-p0"})
        for (const auto& resolution : organ_.resolutions()) {
          s.bundle.element = element, s.bundle.resolution = resolution;
          add(s, "poisson");
        }
    }
  }

  const OrganCase& organ_;
  int crowd_;
  const std::vector<std::string>& references_;
  std::vector<PlannedPoint> points_;
};

}  // namespace

std::vector<PlannedPoint> plan_study(const OrganCase& organ, int crowd, const std::vector<std::string>& references) {
  return Plan(organ, crowd, references).all();
}

}  // namespace palpate::accuracy
