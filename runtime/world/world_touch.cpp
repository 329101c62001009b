// The touch step of a world: the tools once, each organ by its own step, and the sums over the organs.
#include <algorithm>
#include <cstring>

#include "runtime/base/contact_nodes.h"
#include "runtime/contact/force_limits.h"
#include "runtime/contact/touch.h"
#include "runtime/needles/effect.h"
#include "runtime/needles/needle.h"
#include "runtime/world/world.h"

namespace palpate {
namespace {

std::size_t bytes_before_organs(std::int32_t tools, std::int32_t organs) {
  return sizeof(palpate_world_contacts) + static_cast<std::size_t>(tools) * sizeof(palpate_world_tool_state) +
         static_cast<std::size_t>(organs) * sizeof(palpate_world_organ_state);
}

class WorldTouch {
 public:
  WorldTouch(palpate_world& world, palpate_world_contacts& out) : world_(world), out_(out) {}

  std::uint32_t step(const palpate_tool* tools, std::int32_t tool_count, double dt) {
    flags_ = world_.input.take(tools, tool_count, dt);
    lay_out();
    world_.plan.ended(WorldPass::input);
    std::size_t end = bytes_before_organs(world_.input.count(), world_.organ_count);
    if (world_.touching.is_on())
      end = touch_together(end);
    else
      for (std::int32_t k = 0; k < world_.organ_count; ++k) end = touch_organ(k, end);
    for (std::int32_t i = 0; i < world_.input.count(); ++i) sum_tool(i);
    forget_absent_tools();
    world_.input.keep_points();
    out_.used_bytes = write_pairs(end);
    out_.flags = flags_, out_.step = ++world_.step;
    world_.plan.ended(WorldPass::output);
    return flags_;
  }

 private:
  void lay_out() {
    out_ = palpate_world_contacts{};
    out_.struct_bytes = sizeof(palpate_world_contacts);
    out_.tool_count = world_.input.count(), out_.organ_count = world_.organ_count;
    out_.tool_state_bytes = sizeof(palpate_world_tool_state);
    out_.organs_offset = static_cast<std::uint32_t>(bytes_before_organs(out_.tool_count, 0));
    out_.organ_state_bytes = sizeof(palpate_world_organ_state);
  }
  palpate_world_tool_state& tool_state(std::int32_t i) {
    return const_cast<palpate_world_tool_state&>(*palpate_world_contacts_tool(&out_, i));
  }
  palpate_world_organ_state& organ_state(std::int32_t k) {
    return const_cast<palpate_world_organ_state&>(*palpate_world_contacts_state(&out_, k));
  }

  palpate_contacts& contacts_at(std::size_t begin) {
    return *reinterpret_cast<palpate_contacts*>(reinterpret_cast<unsigned char*>(&out_) + begin);
  }
  static std::size_t whole_words(std::size_t bytes) { return (bytes + 7) / 8 * 8; }

  // Writes the organ's contacts at `begin` of the result. Returns where they end.
  std::size_t touch_organ(std::int32_t k, std::size_t begin) {
    palpate_scene& scene = *world_.organ[k];
    const std::uint32_t flags = touch_step(scene.context, scene.touch, world_.input.list_for(k), world_.input.count(),
                                           world_.input.dt(), contacts_at(begin));
    return end_organ(k, flags, begin);
  }
  std::size_t end_organ(std::int32_t k, std::uint32_t flags, std::size_t begin) {
    palpate_scene& scene = *world_.organ[k];
    palpate_world_organ_state& state = organ_state(k);
    state = palpate_world_organ_state{};
    state.contacts_offset = begin;
    state.flags = flags;
    state.near_tools = world_.organ_input[k].near_count();
    flags_ |= flags;
    sum_organ(scene, contacts_at(begin), state);
    world_.plan.ended(WorldPass::output);
    return begin + whole_words(contacts_at(begin).used_bytes);
  }

  // Organs that touch or that links join: all are begun before any is solved, each with room for all that it may find.
  std::size_t touch_together(std::size_t begin) {
    std::size_t room = begin;
    for (std::int32_t k = 0; k < world_.organ_count; ++k) {
      world_.touching.begin(k, world_.input.list_for(k), world_.input.count(), world_.input.dt(), contacts_at(room));
      room += whole_words(palpate_contacts_bytes(world_.organ[k]));
    }
    flags_ |= world_.touching.find_pairs();
    world_.plan.ended(WorldPass::search);
    flags_ |= world_.touching.request_links();
    flags_ |= world_.touching.solve();
    world_.plan.ended(WorldPass::solve);
    room = begin;
    for (std::int32_t k = 0; k < world_.organ_count; ++k) {
      const std::uint32_t flags = world_.touching.finish(k);
      std::memmove(&contacts_at(begin), &contacts_at(room), contacts_at(room).used_bytes);
      begin = end_organ(k, flags, begin);
      room += whole_words(palpate_contacts_bytes(world_.organ[k]));
    }
    flags_ |= world_.touching.end_links(world_.step + 1);
    world_.plan.ended(WorldPass::links);
    return begin;
  }

  // Behind all contacts. Returns where they end.
  std::size_t write_pairs(std::size_t begin) {
    out_.pairs_offset = begin, out_.pair_bytes = sizeof(palpate_world_pair);
    if (!world_.touching.has_pairs()) return begin;
    out_.pair_count = world_.touching.pair_count(), out_.pair_sweeps = world_.touching.sweeps();
    for (std::int32_t i = 0; i < out_.pair_count; ++i) {
      auto* const pair = const_cast<palpate_world_pair*>(palpate_world_contacts_pair(&out_, i));
      world_.touching.write_pair(i, pair);
      for (int side = 0; side < 2; ++side)
        for (int d = 0; d < 3; ++d) organ_state(pair->organ[side]).pressed[d] += (side == 0 ? 1 : -1) * pair->force[d];
    }
    return begin + static_cast<std::size_t>(out_.pair_count) * sizeof(palpate_world_pair);
  }

  // A needle holds nodes inside of the organ, too.
  static void sum_organ(const palpate_scene& scene, const palpate_contacts& contacts,
                        palpate_world_organ_state& state) {
    Vec3 force, torque;
    const palpate_contact_node* const nodes = nodes_behind(contacts);
    const auto* const needles = static_cast<const Needles*>(scene.state_of(needles_effect));
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      if (nodes[e].source > PALPATE_SOURCE_NEEDLE) continue;
      const Vec3 f = load3(nodes[e].force);
      force += f;
      if (nodes[e].source == PALPATE_SOURCE_NEEDLE)
        torque += cross(needles->at_rest(nodes[e].node), f);
      else if (scene.touch.surface.rest)
        torque += cross(load3(scene.touch.surface.rest + 3 * static_cast<std::size_t>(nodes[e].node)), f);
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
    SentToTool& sent = world_.sent[world_.input.place(i)];
    if (tool.is_new) sent = SentToTool{};
    if (!tool.has_torque) sent.torque = Vec3{};
    const double dt = world_.input.dt();
    const palpate_world_def& def = world_.def;
    std::uint32_t flags = 0;
    store3(within_limits(force, def.force_limit, def.force_slew, dt, &sent.force, &flags), state.force);
    if (tool.has_torque)
      store3(within_limits(torque, def.torque_limit, def.torque_slew, dt, &sent.torque, &flags), state.torque);
    state.flags |= flags, flags_ |= flags;
  }

  // A tool that is not sent has no force when it comes back.
  void forget_absent_tools() {
    bool sent[PALPATE_MAX_TOOLS] = {};
    for (std::int32_t i = 0; i < world_.input.count(); ++i) sent[world_.input.place(i)] = true;
    for (std::int32_t t = 0; t < PALPATE_MAX_TOOLS; ++t)
      if (!sent[t]) world_.sent[t] = SentToTool{};
  }

  palpate_world& world_;
  palpate_world_contacts& out_;
  std::uint32_t flags_ = 0;
};

}  // namespace

std::uint32_t touch_world(palpate_world& world, const palpate_tool* tools, std::int32_t tool_count, double dt,
                          palpate_world_contacts& out) {
  return WorldTouch(world, out).step(tools, tool_count, dt);
}

std::size_t bytes_of_world_contacts(const palpate_world& world) {
  std::size_t bytes = bytes_before_organs(PALPATE_MAX_TOOLS, world.organ_count);
  for (std::int32_t k = 0; k < world.organ_count; ++k) bytes += (palpate_contacts_bytes(world.organ[k]) + 7) / 8 * 8;
  if (world.touching.has_pairs()) bytes += static_cast<std::size_t>(world.def.max_pairs) * sizeof(palpate_world_pair);
  return bytes;
}

}  // namespace palpate
