// The touch step of a world: the tools once, each organ by its own step, and the sums over the organs.
#include "runtime/base/contact_nodes.h"
#include "runtime/contact/force_limits.h"
#include "runtime/contact/touch.h"
#include "runtime/world/world.h"

namespace palpate {
namespace {

std::size_t bytes_before_organs(std::int32_t tools, std::int32_t organs) {
  return sizeof(palpate_world_contacts) + static_cast<std::size_t>(tools) * sizeof(palpate_world_tool_state) +
         static_cast<std::size_t>(organs) * sizeof(palpate_world_organ_state);
}

std::size_t whole_words(std::size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

class WorldTouch {
 public:
  WorldTouch(palpate_world& world, palpate_world_contacts& out) : world_(world), step_(world.in_step), out_(out) {}

  std::uint32_t step(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    step_.flags = world_.input.take(tools, tool_count, dt);
    step_.number = ++world_.step, step_.joint_count = step_.sweeps = 0;
    lay_out();
    world_.plan.ended(WorldPass::input);
    for (std::int32_t k = 0; k < world_.organ_count; ++k) begin_organ(k);
    for_sources([&](WorldSource& source) { source.begin(step_), source.request(step_); });
    world_.islands.solve(step_);
    world_.plan.ended(WorldPass::solve);
    for (std::int32_t k = 0; k < world_.organ_count; ++k) finish_organ(k);
    for_sources([&](WorldSource& source) { source.end(step_); });
    for (std::int32_t i = 0; i < world_.input.count(); ++i) sum_tool(i);
    forget_absent_tools();
    world_.input.keep_points();
    for (std::int32_t s = 0; s < step_.source_count; ++s) step_.sources[s]->tell(step_, out_);
    out_.flags = step_.flags, out_.step = step_.number;
    world_.plan.ended(WorldPass::output);
    return step_.flags;
  }

 private:
  void lay_out() {
    out_ = palpate_world_contacts{};
    out_.struct_bytes = sizeof(palpate_world_contacts);
    out_.tool_count = world_.input.count(), out_.organ_count = world_.organ_count;
    out_.tool_state_bytes = sizeof(palpate_world_tool_state);
    out_.organs_offset = static_cast<std::uint32_t>(bytes_before_organs(out_.tool_count, 0));
    out_.organ_state_bytes = sizeof(palpate_world_organ_state);
    out_.used_bytes = bytes_before_organs(out_.tool_count, out_.organ_count);
  }
  palpate_world_tool_state& tool_state(std::int32_t i) {
    return const_cast<palpate_world_tool_state&>(*palpate_world_contacts_tool(&out_, i));
  }
  palpate_world_organ_state& organ_state(std::int32_t k) {
    return const_cast<palpate_world_organ_state&>(*palpate_world_contacts_state(&out_, k));
  }

  template <class Each>
  void for_sources(const Each& each) {
    for (std::int32_t s = 0; s < step_.source_count; ++s) {
      each(*step_.sources[s]);
      world_.plan.ended(step_.sources[s]->pass());
    }
  }

  void begin_organ(std::int32_t k) {
    palpate_scene& scene = *world_.organ[k];
    begin_touch(step_.of_organ[k], scene.context, scene.touch, world_.input.list_for(k), world_.input.count(),
                world_.input.dt());
  }
  // Writes the organ's contacts behind all that is written.
  void finish_organ(std::int32_t k) {
    auto& contacts = *reinterpret_cast<palpate_contacts*>(reinterpret_cast<unsigned char*>(&out_) + out_.used_bytes);
    palpate_world_organ_state& state = organ_state(k);
    state = palpate_world_organ_state{};
    state.contacts_offset = out_.used_bytes;
    state.flags = finish_touch(step_.of_organ[k], world_.islands.outcome(k), contacts);
    state.near_tools = world_.organ_input[k].near_count();
    step_.flags |= state.flags;
    sum_organ(*world_.organ[k], contacts, state);
    out_.used_bytes += whole_words(contacts.used_bytes);
    world_.plan.ended(WorldPass::output);
  }

  static void sum_organ(const palpate_scene& scene, const palpate_contacts& contacts,
                        palpate_world_organ_state& state) {
    Vec3 force, torque;
    const palpate_contact_node* const nodes = nodes_behind(contacts);
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      if (nodes[e].source > kLastSourceOfTools) continue;
      const Vec3 f = load3(nodes[e].force);
      force += f;
      torque += cross(scene.touch.surface.place(nodes[e].node), f);
    }
    store3(scene.touch.organ.vector_to_world(force), state.force);
    store3(scene.touch.organ.vector_to_world(torque), state.torque);
  }

  void sum_tool(std::int32_t i) {
    palpate_world_tool_state& state = tool_state(i);
    state = palpate_world_tool_state{};
    state.id = world_.input.tool(i).id;
    Vec3 force, torque;
    for (std::int32_t k = 0; k < world_.organ_count; ++k) {
      const palpate_tool_state& of_organ = *palpate_contacts_tool(palpate_world_contacts_organ(&out_, k), i);
      // The first one as it is: adding zero would change the sign of a zero.
      force = k == 0 ? load3(of_organ.force_raw) : force + load3(of_organ.force_raw);
      torque = k == 0 ? load3(of_organ.torque_raw) : torque + load3(of_organ.torque_raw);
      state.organ_count += of_organ.contact_count > 0;
      state.contact_count += of_organ.contact_count;
      state.slip_count += of_organ.slip_count, state.release_count += of_organ.release_count;
      state.flags |= of_organ.flags;
    }
    store3(force, state.force_raw);
    store3(torque, state.torque_raw);
    limit(i, force, torque, state);
  }

  void limit(std::int32_t i, Vec3 force, Vec3 torque, palpate_world_tool_state& state) {
    const Tool& tool = world_.input.tool(i);
    SentForce& sent = world_.sent[world_.input.place(i)];
    if (tool.is_new) sent = SentForce{};
    if (!tool.has_torque) sent.torque = Vec3{};
    const double dt = world_.input.dt();
    const palpate_world_def& def = world_.def;
    std::uint32_t flags = 0;
    store3(within_limits(force, def.force_limit, def.force_slew, dt, &sent.force, &flags), state.force);
    if (tool.has_torque)
      store3(within_limits(torque, def.torque_limit, def.torque_slew, dt, &sent.torque, &flags), state.torque);
    state.flags |= flags, step_.flags |= flags;
  }

  // A tool that is not sent has no force when it comes back.
  void forget_absent_tools() {
    bool sent[PALPATE_MAX_TOOLS] = {};
    for (std::int32_t i = 0; i < world_.input.count(); ++i) sent[world_.input.place(i)] = true;
    for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t)
      if (!sent[t]) world_.sent[t] = SentForce{};
  }

  palpate_world& world_;
  WorldStep& step_;
  palpate_world_contacts& out_;
};

}  // namespace

std::uint32_t touch_world(palpate_world& world, const palpate_tool* tools, std::int32_t tool_count, double dt,
                          palpate_world_contacts& out) {
  return WorldTouch(world, out).step(tools, tool_count, dt);
}

std::size_t bytes_of_world_contacts(const palpate_world& world) {
  std::size_t bytes = bytes_before_organs(PALPATE_MAX_TOOLS, world.organ_count);
  for (std::int32_t k = 0; k < world.organ_count; ++k) bytes += whole_words(palpate_contacts_bytes(world.organ[k]));
  for (std::int32_t s = 0; s < world.in_step.source_count; ++s) bytes += world.in_step.sources[s]->most_told_bytes();
  return bytes;
}

}  // namespace palpate
