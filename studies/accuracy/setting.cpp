#include "studies/accuracy/setting.h"

#include <fmt/format.h>

namespace palpate::accuracy {

std::string name_of(const Setting& setting) {
  const BundleSetting& b = setting.bundle;
  const SceneSetting &s = setting.scene, plain;
  std::string name = b.resolution + " " + b.element;
  if (b.storage != "f32") name += " " + b.storage;
  if (b.poisson != 0) name += fmt::format(", nu {}", b.poisson);
  if (b.solver != "auto") name += ", " + b.solver;
  if (b.tolerance != BundleSetting{}.tolerance) name += fmt::format(", tolerance {:.0e}", b.tolerance);
  if (b.large) name += ", large";
  if (s.contact != plain.contact) name += ", " + s.contact + " contact";
  if (s.exercise != plain.exercise) name += ", " + s.exercise;
  if (s.law != plain.law) name += ", " + s.law;
  if (s.contacts != plain.contacts) name += fmt::format(", {} contacts", s.contacts);
  if (s.exercise == "neighbour") name += ", collision " + s.collision;
  if (s.exercise == "drag") name += ", surface " + s.surface + ", collision " + s.collision;
  if (s.exercise == "measured") name += s.response ? ", response on" : ", response off";
  if (s.exercise == "hold") name += s.relaxation ? ", relaxation on" : ", relaxation off";
  return name;
}

}  // namespace palpate::accuracy
