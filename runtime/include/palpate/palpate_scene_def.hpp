// palpate_scene_def.hpp - a palpate_scene_def that has the struct of each effect in it, for C++17.
//
//     palpate::SceneDef def;
//     def.collision = PALPATE_COLLISION_DEFORMED;
//     def.report.report = PALPATE_REPORT_CONTACTS;
//     def.relaxation.terms = 1, def.relaxation.share[0] = 0.4, def.relaxation.time[0] = 2;
//     palpate_scene_create(bundle, &def, &scene, &error);
//
// Each effect is off until the field that switches it is set, the first one of its struct: palpate_keys.h. Copies have chains of their own. A host
// that uses this links all effects.
#pragma once

#include <initializer_list>

#include "palpate_complete.h"

namespace palpate {

// The struct of one effect in such a definition. A struct that is assigned to it changes its fields, and not its place in the chain.
template <class Struct>
struct ChainedPart : Struct {
  explicit ChainedPart(const Struct& off) noexcept : Struct(off) {}
  ChainedPart(const ChainedPart&) = default;
  ChainedPart& operator=(const ChainedPart& from) noexcept { return *this = static_cast<const Struct&>(from); }
  ChainedPart& operator=(const Struct& from) noexcept {
    const palpate_part* const next = this->part.next;
    Struct::operator=(from);
    this->part.next = next;
    return *this;
  }
};

struct PartsOfScene {
  ChainedPart<palpate_relaxation_def> relaxation{palpate_default_relaxation_def()};
  ChainedPart<palpate_large_def> large{palpate_default_large_def()};
  ChainedPart<palpate_fine_surface> fine_surface{palpate_default_fine_surface()};
  ChainedPart<palpate_grasps_def> grasps{palpate_default_grasps_def()};
  ChainedPart<palpate_needles_def> needles{palpate_default_needles_def()};
  ChainedPart<palpate_motions_def> motions{palpate_default_motions_def()};
  ChainedPart<palpate_links_def> links{palpate_default_links_def()};
  ChainedPart<palpate_report_def> report{palpate_default_report_def()};
  ChainedPart<palpate_queries_def> queries{palpate_default_queries_def()};
  ChainedPart<palpate_render_mesh> render_mesh{palpate_default_render_mesh()};
  ChainedPart<palpate_dent_def> dent{palpate_default_dent_def()};
  ChainedPart<palpate_inside_def> inside{palpate_default_inside_def()};
  ChainedPart<palpate_loads_def> loads{palpate_default_loads_def()};
  ChainedPart<palpate_force_control_def> force_control{palpate_default_force_control_def()};
  ChainedPart<palpate_crossings_def> crossings{palpate_default_crossings_def()};
  ChainedPart<palpate_obstacles_def> obstacles{palpate_default_obstacles_def()};
  ChainedPart<palpate_cut_def> cut{palpate_default_cut_def()};
};

// The fields of palpate_scene_def, and the structs of all effects.
struct SceneDef : palpate_scene_def, PartsOfScene {
  SceneDef() noexcept : palpate_scene_def(palpate_default_scene_def()) {
    large.deformation = PALPATE_DEFORMATION_LINEAR;
    grasps.grasps = needles.needles = motions.motions = force_control.force_control = 0;
    report.report = PALPATE_REPORT_OFF, queries.queries = PALPATE_QUERIES_OFF;
    dent.dent = PALPATE_DENT_OFF, inside.inside = PALPATE_INSIDE_OFF, crossings.crossings = PALPATE_CROSSINGS_OFF;
    cut.cut = PALPATE_CUT_OFF;
    chain();
  }
  SceneDef(const SceneDef& from) noexcept : palpate_scene_def(from), PartsOfScene(from) { chain(); }
  SceneDef& operator=(const SceneDef& from) noexcept {
    palpate_scene_def::operator=(from);
    PartsOfScene::operator=(from);
    chain();
    return *this;
  }

 private:
  void chain() noexcept {
    parts = nullptr;
    for (palpate_part* each :
         {&cut.part, &crossings.part, &obstacles.part, &force_control.part, &loads.part, &inside.part, &dent.part,
          &render_mesh.part, &queries.part, &report.part, &links.part, &motions.part, &needles.part, &grasps.part,
          &fine_surface.part, &large.part, &relaxation.part})
      palpate_add_part(&parts, each);
  }
};

}  // namespace palpate
