#include "programs/link/contacts_datagram.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "formats/checksum.h"
#include "formats/errors.h"

namespace palpate {
namespace {

constexpr unsigned char kMagic[8] = {'P', 'A', 'L', 'P', 'L', 'I', 'N', 'K'};
constexpr std::size_t kChecksumAt = 16;

// One number after another, little-endian. Writer and Reader have the same calls, so that one list of fields serves both ways.
class Writer {
 public:
  explicit Writer(unsigned char* to) : at_(to) {}
  template <typename Number>
  void operator()(Number value) {
    if constexpr (std::is_same_v<Number, double>)
      put(std::bit_cast<std::uint64_t>(value), 8);
    else
      put(static_cast<std::uint64_t>(value), std::max<int>(4, sizeof value));
  }
  template <std::size_t N>
  void operator()(const double (&values)[N]) {
    for (const double value : values) (*this)(value);
  }
  void operator()(const SceneConfig::Vector& values) {
    for (const double value : values) (*this)(value);
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
  template <typename Number>
  void operator()(Number& value) {
    if constexpr (std::is_same_v<Number, double>)
      value = std::bit_cast<double>(get(8));
    else
      value = static_cast<Number>(get(std::max<int>(4, sizeof value)));
  }
  template <std::size_t N>
  void operator()(double (&values)[N]) {
    for (double& value : values) (*this)(value);
  }
  void operator()(SceneConfig::Vector& values) {
    for (double& value : values) (*this)(value);
  }
  template <typename Number>
  Number next() {
    Number value;
    (*this)(value);
    return value;
  }

 private:
  std::uint64_t get(int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i) value |= static_cast<std::uint64_t>(*at_++) << 8 * i;
    return value;
  }
  const unsigned char* at_;
};

// The fields of README.md's table in their order: the header behind the checksum, a tool, a contact node. The types are const where they
// are written.
template <typename Io, typename Note, typename Contacts>
void pass_header(Io& io, Note& note, Contacts& contacts) {
  io(note.bundle), io(note.session), io(note.sequence), io(contacts.step), io(note.time), io(note.sent), io(note.last);
  io(contacts.flags), io(contacts.sweeps), io(contacts.tool_count), io(contacts.node_count), io(contacts.newton_steps);
  io(contacts.residual_displacement), io(contacts.residual_force);
  io(contacts.organ_position), io(contacts.organ_orientation), io(contacts.operations);
}
template <typename Io, typename Tool, typename Position>
void pass_tool(Io& io, Tool& tool, Position& position) {
  io(position), io(tool.force), io(tool.force_raw), io(tool.direction), io(tool.torque), io(tool.torque_raw);
  io(tool.contact_count), io(tool.slip_count), io(tool.release_count), io(tool.flags);
}
template <typename Io, typename Node>
void pass_node(Io& io, Node& node) {
  io(node.column), io(node.source), io(node.index), io(node.point);
  io(node.modified_displacement), io(node.force);
}

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

DatagramFault fault_of(const palpate_tool_state& tool, const SceneConfig::Vector& position) {
  if (!is_sane(position.data(), 3) || !is_sane(tool.force, 3) || !is_sane(tool.force_raw, 3) ||
      !is_direction(tool.direction) || !is_sane(tool.torque, 3) || !is_sane(tool.torque_raw, 3))
    return DatagramFault::number;
  const bool counted = tool.contact_count >= 0 && tool.slip_count >= 0 && tool.release_count >= 0;
  return counted ? DatagramFault::none : DatagramFault::counts;
}

DatagramFault fault_of(const palpate_contact_node& node, int tools, const DatagramLimits& limits) {
  const bool of_tool = node.source == PALPATE_SOURCE_TOOL;
  if (node.column < 0 || static_cast<std::size_t>(node.column) >= limits.touchable.size() ||
      !(of_tool || node.source == PALPATE_SOURCE_LINK || node.source == PALPATE_SOURCE_OBSTACLE) || node.index < 0 ||
      (of_tool && node.index >= tools) || node.point < 0)
    return DatagramFault::index;
  return is_sane(node.modified_displacement, 3) && is_sane(node.force, 3) ? DatagramFault::none : DatagramFault::number;
}

}  // namespace

void check_deformation(const SceneConfig& scene) {
  for (const auto& [key, count] : {std::pair{"motion", scene.motions.size()}, {"load", scene.loads.size()}})
    if (count > 0)
      throw InputError(
          fmt::format("{}: {}: expected a scene without [[{}]], since a datagram holds contacts and "
                      "not the amounts of {}s, found {}; play the scene with palpate-run or palpate-igtl",
                      scene.file.string(), key, key, key, count));
  if (scene.def.cut.cut != PALPATE_CUT_OFF)
    throw InputError(
        fmt::format("{}: expected a scene that does not cut, since a datagram holds contacts and not the mesh, found "
                    "[[blade]], [[removal]] or cut = true; play the scene with palpate-run or palpate-igtl",
                    scene.file.string()));
  for (const SceneConfig::Tool& tool : scene.tools)
    if (tool.needle)
      throw InputError(fmt::format(
          "{}: tool \"{}\": expected a tool without [tool.needle], since a datagram holds contacts at touchable nodes "
          "and a needle also holds nodes inside, found one; play the scene with palpate-run or palpate-igtl",
          scene.file.string(), tool.name));
  if (scene.def.large.deformation == PALPATE_DEFORMATION_LINEAR) return;
  throw InputError(fmt::format(
      "{}: effects.deformation: expected \"linear\", since a datagram holds contacts and not the displacement "
      "of every node, found \"{}\"; play the scene with palpate-run or palpate-igtl",
      scene.file.string(), word_of("deformation", scene.def)));
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
  out(kDatagramVersion), out(static_cast<std::uint32_t>(bytes)), out(std::uint64_t{0});  // the checksum: below
  pass_header(out, note, contacts);
  out(std::uint32_t{0});
  for (std::int32_t t = 0; t < contacts.tool_count; ++t)
    pass_tool(out, *palpate_contacts_tool(&contacts, t), note.positions[static_cast<std::size_t>(t)]);
  for (std::int32_t n = 0; n < contacts.node_count; ++n) pass_node(out, *palpate_contacts_node(&contacts, n));
  Writer(to + kChecksumAt)(checksum_of(to, bytes));
  return bytes;
}

DatagramFault decode_contacts(std::span<const unsigned char> bytes, const DatagramLimits& limits,
                              palpate_contacts* contacts, DatagramNote* note) {
  if (bytes.size() < kDatagramHeaderBytes) return DatagramFault::size;
  if (!std::equal(std::begin(kMagic), std::end(kMagic), bytes.begin())) return DatagramFault::magic;
  Reader in(bytes.data() + sizeof kMagic);
  if (in.next<std::uint32_t>() != kDatagramVersion) return DatagramFault::version;
  if (in.next<std::uint32_t>() != bytes.size()) return DatagramFault::size;
  if (in.next<std::uint64_t>() != checksum_of(bytes.data(), bytes.size())) return DatagramFault::checksum;
  *contacts = palpate_contacts{};
  pass_header(in, *note, *contacts);
  if (note->bundle != limits.bundle) return DatagramFault::bundle;
  contacts->least_volume = 1;  // what concerns `deformation: large` is not sent
  in.next<std::uint32_t>();
  const auto tools = static_cast<std::uint32_t>(contacts->tool_count),
             nodes = static_cast<std::uint32_t>(contacts->node_count);
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
    pass_tool(in, tool_of(contacts, t), note->positions[t]);
    fault = fault_of(tool_of(contacts, t), note->positions[t]);
  }
  for (std::uint32_t n = 0; n < nodes && fault == DatagramFault::none; ++n) {
    palpate_contact_node& node = node_of(contacts, n) = palpate_contact_node{};
    pass_node(in, node);
    fault = fault_of(node, contacts->tool_count, limits);
    if (fault == DatagramFault::none) node.node = limits.touchable[static_cast<std::size_t>(node.column)];
  }
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
