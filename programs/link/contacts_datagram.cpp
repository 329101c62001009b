#include "programs/link/contacts_datagram.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "formats/checksum.h"
#include "formats/errors.h"

namespace palpate {
namespace {

constexpr unsigned char kMagic[8] = {'P', 'A', 'L', 'P', 'L', 'I', 'N', 'K'};
constexpr std::size_t kChecksumAt = 16;

class Writer {
 public:
  explicit Writer(unsigned char* to) : at_(to) {}
  void u32(std::uint32_t value) { put(value, 4); }
  void u64(std::uint64_t value) { put(value, 8); }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
  void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
  void vector(const double* v, int count = 3) {
    for (int d = 0; d < count; ++d) f64(v[d]);
  }

 private:
  void put(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) *at_++ = static_cast<unsigned char>(value >> 8 * i);
  }
  unsigned char* at_;
};

// Reads bytes whose number was checked before.
class Reader {
 public:
  explicit Reader(const unsigned char* from) : at_(from) {}
  std::uint32_t u32() { return static_cast<std::uint32_t>(get(4)); }
  std::uint64_t u64() { return get(8); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  void vector(double* v, int count = 3) {
    for (int d = 0; d < count; ++d) v[d] = f64();
  }

 private:
  std::uint64_t get(int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value |= static_cast<std::uint64_t>(*at_++) << 8 * i;
    return value;
  }
  const unsigned char* at_;
};

// The checksum is computed with its own bytes as zero.
std::uint64_t checksum_of(const unsigned char* bytes, std::size_t count) {
  constexpr unsigned char kZero[8] = {};
  formats::Xxh64 sum;
  sum.update(bytes, kChecksumAt);
  sum.update(kZero, sizeof kZero);
  sum.update(bytes + kChecksumAt + 8, count - kChecksumAt - 8);
  return sum.digest();
}

// The counts and where the parts lie, as palpate_scene_touch writes them.
void lay_out(palpate_contacts* contacts, std::uint32_t tools, std::uint32_t nodes) {
  contacts->struct_bytes = sizeof(palpate_contacts);
  contacts->tool_state_bytes = sizeof(palpate_tool_state);
  contacts->node_bytes = sizeof(palpate_contact_node);
  contacts->tool_count = static_cast<std::int32_t>(tools);
  contacts->node_count = static_cast<std::int32_t>(nodes);
  contacts->nodes_offset = contacts->struct_bytes + tools * contacts->tool_state_bytes;
  contacts->used_bytes = contacts->nodes_offset + nodes * contacts->node_bytes;
}

palpate_tool_state& tool_of(palpate_contacts* contacts, std::uint32_t tool) {
  return const_cast<palpate_tool_state&>(*palpate_contacts_tool(contacts, static_cast<std::int32_t>(tool)));
}
palpate_contact_node& node_of(palpate_contacts* contacts, std::uint32_t node) {
  return const_cast<palpate_contact_node&>(*palpate_contacts_node(contacts, static_cast<std::int32_t>(node)));
}

// The largest force, displacement or position that is accepted: far above what a scene can have, far below overflow.
constexpr double kGreatest = 1e12;
bool is_sane(const double* v, int count) {
  return std::all_of(v, v + count, [](double x) { return std::fabs(x) <= kGreatest; });  // false for NaN
}

// Its length is a share (palpate_tool_state).
bool is_direction(const double* d) {
  return std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) <= 1 + 1e-6;  // false for NaN
}

// As palpate_pose has it.
bool is_pose(const double* position, const double* orientation) {
  double square = 0;
  for (int i = 0; i < 4; ++i) square += orientation[i] * orientation[i];
  return is_sane(position, 3) && std::fabs(std::sqrt(square) - 1) <= 1e-3;  // false for NaN
}

DatagramFault read_tool(Reader& in, palpate_tool_state& tool, SceneConfig::Vector& position) {
  in.vector(position.data());
  in.vector(tool.force);
  in.vector(tool.force_raw);
  in.vector(tool.direction);
  in.vector(tool.torque);
  in.vector(tool.torque_raw);
  tool.contact_count = in.i32();
  tool.slip_count = in.i32();
  tool.release_count = in.i32();
  tool.flags = in.u32();
  if (!is_sane(position.data(), 3) || !is_sane(tool.force, 3) || !is_sane(tool.force_raw, 3) ||
      !is_direction(tool.direction) || !is_sane(tool.torque, 3) || !is_sane(tool.torque_raw, 3))
    return DatagramFault::number;
  const bool counted = tool.contact_count >= 0 && tool.slip_count >= 0 && tool.release_count >= 0;
  return counted ? DatagramFault::none : DatagramFault::counts;
}

DatagramFault read_node(Reader& in, palpate_contact_node& node, int tools, const DatagramLimits& limits) {
  node.node = in.i32();
  node.column = in.i32();
  node.tool = in.i32();
  node.point = in.i32();
  in.vector(node.modified_displacement);
  in.vector(node.force);
  if (node.column < 0 || static_cast<std::size_t>(node.column) >= limits.touchable.size() ||
      node.node != limits.touchable[static_cast<std::size_t>(node.column)] || node.tool < -1 || node.tool >= tools ||
      node.point < 0)
    return DatagramFault::index;
  return is_sane(node.modified_displacement, 3) && is_sane(node.force, 3) ? DatagramFault::none : DatagramFault::number;
}

}  // namespace

void check_deformation(const SceneConfig& scene) {
  if (!scene.motions.empty())
    throw InputError(
        fmt::format("{}: motion: expected a scene without [[motion]], since a datagram holds contacts and "
                    "not the amounts of motions, found {}; play the scene with palpate-run or palpate-igtl",
                    scene.file.string(), scene.motions.size()));
  for (const SceneConfig::Tool& tool : scene.tools)
    if (tool.needle)
      throw InputError(fmt::format(
          "{}: tool \"{}\": expected a tool without [tool.needle], since a datagram holds contacts at "
          "touchable nodes and a needle also holds nodes inside, found one; play the scene with palpate-run "
          "or palpate-igtl",
          scene.file.string(), tool.name));
  if (scene.deformation == SceneConfig::Deformation::linear) return;
  static const char* const words[] = {"linear", "large", "large-beside", "large-renewed"};
  throw InputError(fmt::format(
      "{}: effects.deformation: expected \"linear\", since a datagram holds contacts and not the displacement "
      "of every node, found \"{}\"; play the scene with palpate-run or palpate-igtl",
      scene.file.string(), words[static_cast<int>(scene.deformation)]));
}

DatagramLimits datagram_limits(const Player& player, std::uint64_t bundle) {
  const std::int32_t* touchable = palpate_bundle_touchable(player.bundle());
  const auto columns = static_cast<std::size_t>(palpate_bundle_describe(player.bundle()).touchable_count);
  return {bundle, static_cast<int>(player.scene().tools.size()), player.contact_node_limit(), {touchable, columns}};
}

std::size_t encode_contacts(const palpate_contacts& contacts, const DatagramNote& note, unsigned char* to) {
  const std::size_t bytes = kDatagramHeaderBytes + static_cast<std::size_t>(contacts.tool_count) * kDatagramToolBytes +
                            static_cast<std::size_t>(contacts.node_count) * kDatagramNodeBytes;
  std::copy(std::begin(kMagic), std::end(kMagic), to);
  Writer out(to + sizeof kMagic);
  out.u32(kDatagramVersion);
  out.u32(static_cast<std::uint32_t>(bytes));
  out.u64(0);  // the checksum, below
  out.u64(note.bundle);
  out.u64(note.session);
  out.u64(note.sequence);
  out.u64(contacts.step);
  out.f64(note.time);
  out.u64(static_cast<std::uint64_t>(note.sent));
  out.u32(note.last ? 1 : 0);
  out.u32(contacts.flags);
  out.i32(contacts.sweeps);
  out.i32(contacts.tool_count);
  out.i32(contacts.node_count);
  out.i32(contacts.newton_steps);
  out.f64(contacts.residual_displacement);
  out.f64(contacts.residual_force);
  out.vector(contacts.organ_position);
  out.vector(contacts.organ_orientation, 4);
  out.i32(contacts.operations);
  out.u32(0);
  for (std::int32_t t = 0; t < contacts.tool_count; ++t) {
    const palpate_tool_state& tool = *palpate_contacts_tool(&contacts, t);
    out.vector(note.positions[static_cast<std::size_t>(t)].data());
    out.vector(tool.force);
    out.vector(tool.force_raw);
    out.vector(tool.direction);
    out.vector(tool.torque);
    out.vector(tool.torque_raw);
    out.i32(tool.contact_count);
    out.i32(tool.slip_count);
    out.i32(tool.release_count);
    out.u32(tool.flags);
  }
  for (std::int32_t n = 0; n < contacts.node_count; ++n) {
    const palpate_contact_node& node = *palpate_contacts_node(&contacts, n);
    out.i32(node.node);
    out.i32(node.column);
    out.i32(node.tool);
    out.i32(node.point);
    out.vector(node.modified_displacement);
    out.vector(node.force);
  }
  Writer(to + kChecksumAt).u64(checksum_of(to, bytes));
  return bytes;
}

DatagramFault decode_contacts(std::span<const unsigned char> bytes, const DatagramLimits& limits,
                              palpate_contacts* contacts, DatagramNote* note) {
  if (bytes.size() < kDatagramHeaderBytes) return DatagramFault::size;
  if (!std::equal(std::begin(kMagic), std::end(kMagic), bytes.begin())) return DatagramFault::magic;
  Reader in(bytes.data() + sizeof kMagic);
  if (in.u32() != kDatagramVersion) return DatagramFault::version;
  if (in.u32() != bytes.size()) return DatagramFault::size;
  if (in.u64() != checksum_of(bytes.data(), bytes.size())) return DatagramFault::checksum;
  note->bundle = in.u64();
  if (note->bundle != limits.bundle) return DatagramFault::bundle;
  note->session = in.u64();
  note->sequence = in.u64();
  *contacts = palpate_contacts{};
  contacts->step = in.u64();
  note->time = in.f64();
  note->sent = static_cast<std::int64_t>(in.u64());
  note->last = in.u32() != 0;
  contacts->flags = in.u32();
  contacts->sweeps = in.i32();
  const std::uint32_t tools = in.u32(), nodes = in.u32();
  contacts->newton_steps = in.i32();
  contacts->least_volume = 1;  // what concerns `deformation: large` is not sent
  contacts->residual_displacement = in.f64();
  contacts->residual_force = in.f64();
  in.vector(contacts->organ_position);
  in.vector(contacts->organ_orientation, 4);
  contacts->operations = in.i32();
  in.u32();
  const auto at_most = [](std::uint32_t count, int limit) { return count <= static_cast<std::uint32_t>(limit); };
  if (!at_most(tools, std::min(limits.tools, PALPATE_MAX_TOOLS)) || !at_most(nodes, limits.nodes) ||
      bytes.size() != kDatagramHeaderBytes + tools * kDatagramToolBytes + nodes * kDatagramNodeBytes)
    return DatagramFault::counts;
  if (!is_sane(&note->time, 1) || !is_sane(&contacts->residual_displacement, 1) ||
      !is_sane(&contacts->residual_force, 1) || !is_pose(contacts->organ_position, contacts->organ_orientation))
    return DatagramFault::number;
  contacts->bundle = note->bundle;
  contacts->node_capacity = limits.nodes;
  lay_out(contacts, tools, nodes);
  DatagramFault fault = DatagramFault::none;
  for (std::uint32_t t = 0; t < tools && fault == DatagramFault::none; ++t) {
    tool_of(contacts, t) = palpate_tool_state{};
    tool_of(contacts, t).id = static_cast<std::int32_t>(t);  // a player's tools have no other id
    fault = read_tool(in, tool_of(contacts, t), note->positions[t]);
  }
  for (std::uint32_t n = 0; n < nodes && fault == DatagramFault::none; ++n)
    fault = read_node(in, node_of(contacts, n), contacts->tool_count, limits);
  return fault;
}

const char* name_of(DatagramFault fault) {
  static const char* const names[kDatagramFaults] = {"none",   "size",   "magic",  "version", "checksum",
                                                     "bundle", "counts", "number", "index"};
  return names[static_cast<int>(fault)];
}

const char* cause_of(DatagramFault fault) {
  static const char* const causes[kDatagramFaults] = {
      "nothing is wrong",
      "its length is not the one it states; something else sends to this port",
      "it is not of palpate-feel; something else sends to this port",
      "it is of another version of the layout; use one version of Palpate on both machines",
      "its checksum does not fit; it was damaged on the way",
      "it is of another bundle; give both programs the same file",
      "it holds more tools or contact nodes than this scene; give both programs the same scene",
      "it holds a number that is not finite or beyond all sense",
      "it names a node, column or tool that this bundle or scene does not have"};
  return causes[static_cast<int>(fault)];
}

}  // namespace palpate
