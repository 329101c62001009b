// Scenes of large deformation follow their tools, or say that they do not: no state is published that has run away.
#include "tests/runtime/large/random_large_scenes.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

void play_random(std::uint64_t seed, int steps, LargeFinds* finds) {
  static const RandomLargeScenes scenes;
  scenes.play(seed, steps, finds, [](const std::string& sentence) { ADD_FAILURE() << sentence; });
}

// More: make -f Makefile.data large-fuzz.
TEST(LargeScenes, RandomScenesStayNearNewtonsMethodAndComeToRest) {
  LargeFinds finds;
  for (std::uint64_t seed = 100; seed < 104; ++seed) play_random(seed, 100, &finds);
  EXPECT_GT(finds.pressed, 100);
  EXPECT_GT(finds.compared, 5);
}

// A tissue that stiffens, beside the touch: the linear response to a jump gave it 10^12 N.
TEST(LargeScenes, ARandomSceneThatRanAwayOnceDoesNot) {
  LargeFinds finds;
  play_random(4, 160, &finds);
}

// Beside the touch, a slender bar between two discs that snaps through: Newton's force falls from 0.44 to 0.05 N from one step to the next, and
// the solutions let go of it in five.
TEST(LargeScenes, ARandomSceneThatSnapsThroughLetsGoOfItsForce) {
  LargeFinds finds;
  play_random(259, 300, &finds);
  EXPECT_GT(finds.letting_go, 0);
}

// Presses, drags and lifts a tool with each law and contact model: the body never has more than the work that was done on it. A contact
// that is dragged from node to node or from triangle to triangle jumps, and a jump's two ends do not tell its work: these press alone.
void expect_no_energy_without_work(std::int64_t max_operations, double most_gained) {
  for (const bool nodal : {false, true})
    for (const LawForm& form : {LawForm(), LawForm(8), LawForm::yeoh(-300, 400), LawForm::ogden(-5, 0.3, 12)}) {
      const TouchedBox box({}, with_large(nodal, form));
      const Seen seen(box, nodal, form);
      const LargeReference reference(seen.body);
      for (int law = 0; law < 4; ++law)
        for (int contact = 0; contact < 4; ++contact) {
          SceneDef def;
          def.large.deformation = PALPATE_DEFORMATION_LARGE, def.shape = PALPATE_SHAPE_VOLUME;
          def.law = static_cast<palpate_contact_law>(law), def.contact = static_cast<palpate_contact_model>(contact);
          def.max_operations = max_operations;
          const ScenePointer scene = box.scene(def);
          Contacts contacts(scene.get());
          EnergyAccount account;
          VectorXd of_energy;
          for (int k = 0; k <= 220; ++k) {
            const double depth = k < 100   ? 1.5e-4 * k
                                 : k < 160 ? 0.015
                                           : 0.015 - 3e-4 * (k - 160),
                         along = def.contact == PALPATE_CONTACT_PATCH ? 3e-4 * std::clamp(k - 100, 0, 60) : 0;
            const double point[3] = {0.0605 - depth, 0.02 + along, 0.02};
            palpate_tool tool = palpate_default_tool();
            tool.points = point, tool.point_count = 1, tool.disc_radius = 0.006, tool.friction = 0.3;
            palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
            const auto u = displacements(scene.get(), contacts, static_cast<std::int32_t>(seen.nodes.size() / 3));
            const VectorXd field =
                Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
            VectorXd force = VectorXd::Zero(field.size());
            for (std::int32_t e = 0; e < contacts->node_count; ++e) {
              const palpate_contact_node* const node = palpate_contacts_node(contacts.get(), e);
              force.segment<3>(3 * node->node) += Vector3d(node->force);
            }
            account.add(reference.energy(field, &of_energy), force, field);
          }
          // A step's frame follows that of the state before it, so its force and its state are of two frames. A state that is solved nearly
          // to the end shows more of that than one that lags.
          EXPECT_LE(account.gained(), most_gained)
              << nodal << words_of(form) << " law " << law << " contact " << contact;
          EXPECT_GT(account.peak(), 1e-4) << law << contact;
        }
    }
}

TEST(LargeScenes, NoLawAndNoModelGivesTheBodyEnergy) {
  expect_no_energy_without_work(300'000, 0.08);
}

// As few steps of the method as there are: a disc that is dragged lags, and its steps are flagged.
TEST(LargeScenes, AStepThatLagsHardlyGivesTheBodyEnergy) {
  expect_no_energy_without_work(60'000, 0.1);
}

}  // namespace
}  // namespace palpate::tests
