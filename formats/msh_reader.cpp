// Our own reader of gmsh's MSH 2.2 and 4.1, ASCII and binary (format: gmsh reference manual, section "MSH file
// format"), so that no program but the mesher links gmsh. Every count is compared with the bytes that are left
// before memory is taken for it.
#include "formats/msh_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <set>

#include "formats/byte_order_mark.h"
#include "formats/errors.h"
#include "formats/program.h"

namespace palpate {

namespace {

constexpr int kTriangle = 2, kTetrahedron = 4;

// Nodes and dimension of gmsh's element types; 0 nodes where the number is not used.
struct ElementKind {
  int nodes, dimension;
};
constexpr ElementKind kKinds[] = {{0, 0},  {2, 1},  {3, 2},  {4, 2},  {4, 3},  {8, 3},  {6, 3},  {5, 3},
                                  {3, 1},  {6, 2},  {9, 2},  {10, 3}, {27, 3}, {18, 3}, {14, 3}, {1, 0},
                                  {8, 2},  {20, 3}, {15, 3}, {13, 3}, {9, 2},  {10, 2}, {12, 2}, {15, 2},
                                  {15, 2}, {21, 2}, {4, 1},  {5, 1},  {6, 1},  {20, 3}, {35, 3}, {56, 3}};

// ---- bytes and words ------------------------------------------------------------------------------------------------

// Reads the file from its start to its end. Fails with the file's name and the line (ASCII) or byte (binary).
class Cursor {
 public:
  Cursor(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name), at_(byte_order_mark(bytes)) {}

  bool binary = false;

  [[noreturn]] void fail(const std::string& what) const { fail_at(at_, what); }
  [[noreturn]] void fail_at(std::size_t at, const std::string& what) const {
    throw InputError(fmt::format("{}: {} {}: {}", name_, binary ? "byte" : "line", binary ? at : line_of(at), what));
  }

  const std::string& name() const { return name_; }
  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  // The next word of an ASCII part, empty at the end of the file.
  std::string_view word() {
    while (at_ < bytes_.size() && is_space(bytes_[at_])) ++at_;
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && !is_space(bytes_[at_])) ++at_;
    return bytes_.substr(begin, at_ - begin);
  }

  // The rest of the line, without its end; the cursor stands at the next line.
  std::string_view line() {
    const std::size_t begin = at_;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    at_ = std::min(end + 1, bytes_.size());
    std::string_view text = bytes_.substr(begin, end - begin);
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }

  template <class Number>
  Number ascii(const char* what) {
    const std::string_view text = word();
    Number value{};
    const char* end = text.data() + text.size();
    const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
    const auto [stop, error] = std::from_chars(text.data() + plus, end, value);
    if (text.empty() || error != std::errc() || stop != end)
      fail_at(at_ - text.size(), fmt::format("expected {}, found {}", what, quoted(text)));
    return value;
  }

  template <class Number>
  Number raw(const char* what) {
    if (left() < sizeof(Number)) fail(fmt::format("expected {}, found the end of the file", what));
    Number value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }

  // A number as the file type says: a word, or its bytes.
  template <class Number>
  Number number(const char* what) {
    return binary ? raw<Number>(what) : ascii<Number>(what);
  }

  // Steps over a number that nobody needs, of which an ASCII file may write anything.
  template <class Number>
  void skip_number(const char* what) {
    if (binary)
      raw<Number>(what);
    else if (word().empty())
      fail(fmt::format("expected {}, found the end of the file", what));
  }

  // A count of things that take at least minimum bytes each, so that the rest of the file can hold them.
  template <class Integer>
  std::size_t count(const char* what, std::size_t minimum) {
    const std::size_t begin = at_;
    const auto value = number<Integer>(what);
    return believable(value, begin, what, minimum);
  }
  template <class Integer>
  std::size_t believable(Integer value, std::size_t begin, const char* what, std::size_t minimum) const {
    const bool negative = value < 0;
    if (negative || static_cast<std::uint64_t>(value) > left() / minimum)
      fail_at(begin, fmt::format("{} is {}, but the {} bytes left in the file cannot hold that", what, value, left()));
    return static_cast<std::size_t>(value);
  }

  // "$Name" that opens or closes a section.
  void expect_word(std::string_view wanted) {
    const std::string_view found = word();
    if (found != wanted) fail_at(at_ - found.size(), fmt::format("expected {}, found {}", wanted, quoted(found)));
  }

  // Steps over a section this reader does not use.
  void skip_section(std::string_view name) {
    const std::string end = "$End" + std::string(name.substr(1));
    const std::size_t found = bytes_.find(end, at_);
    if (found == std::string_view::npos) fail(fmt::format("section {} has no {}", name, end));
    at_ = found + end.size();
  }

  static std::string quoted(std::string_view text) {
    if (text.empty()) return "the end of the file";
    std::string shown = "'";
    for (const char c : text.substr(0, 40)) shown += c >= ' ' && c < 127 ? c : '?';
    return shown + (text.size() > 40 ? "...'" : "'");
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
  std::size_t line_of(std::size_t at) const {
    return 1 +
           static_cast<std::size_t>(std::count(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_;
};

// ---- what the sections hold -----------------------------------------------------------------------------------------

struct Element {
  int entity;         // geometric entity of its own dimension
  int physical;       // MSH 2.2: the physical group, 0 for none; MSH 4.1: taken from the entity
  std::uint64_t tag;  // the file's own number, for sentences
  std::size_t at;     // where in the file, for sentences
  std::uint64_t nodes[4];
};

using EntityKey = std::pair<int, int>;  // dimension, tag

struct MshFile {
  bool version_4 = false;
  std::map<EntityKey, std::string> physical_names;
  std::map<EntityKey, std::vector<int>> physical_of_entity;
  std::vector<std::uint64_t> node_tags;
  std::vector<std::array<double, 3>> nodes;
  std::map<std::size_t, std::size_t> not_finite;  // nodes that no tetrahedron may use, and where in the file they are
  std::vector<Element> triangles, tetrahedra;
  std::uint64_t ignored = 0;
  bool has_nodes = false, has_elements = false;
};

// A negative number is the same group with reversed orientation.
int group_number(std::int32_t written) {
  return written == INT32_MIN ? 0 : std::abs(written);
}

void read_format(Cursor& in, MshFile& file) {
  const std::string_view first = in.word();
  if (first == "$NOD")
    in.fail_at(0, fmt::format("expected MSH version 2.2 or 4.1, found version 1 ($NOD), which has no names of regions; "
                              "gmsh converts it: gmsh {} -save -format msh41 -o NEW.msh",
                              in.name()));
  if (first != "$MeshFormat")
    in.fail_at(in.at() - first.size(), "expected $MeshFormat, found " + Cursor::quoted(first));
  const std::size_t begin = in.at();
  const auto version = in.ascii<double>("the format's version");
  if (version != 2.2 && version != 4.1)
    in.fail_at(begin + 1, fmt::format("expected MSH version 2.2 or 4.1, found {}; save the mesh as 4.1", version));
  file.version_4 = version == 4.1;
  const auto type = in.ascii<int>("the file type, 0 or 1");
  const auto bytes = in.ascii<int>("the size of a floating-point number");
  if ((type != 0 && type != 1) || bytes != 8)
    in.fail(fmt::format("expected file type 0 or 1 and numbers of 8 bytes, found {} and {}", type, bytes));
  in.line();
  if (type == 1) {
    in.binary = true;
    if (in.raw<std::int32_t>("the number one that shows the byte order") != 1)
      in.fail(
          "expected the number one, found another: the file was written with another byte order; save it again as "
          "ASCII");
    in.binary = false;  // section names are words in either type
  }
  in.expect_word("$EndMeshFormat");
  in.binary = type == 1;
}

void read_physical_names(Cursor& in, MshFile& file) {
  const bool binary = in.binary;
  in.binary = false;  // always ASCII
  const std::size_t count = in.count<std::int64_t>("the number of physical names", 6);
  for (std::size_t i = 0; i < count; ++i) {
    const auto dimension = in.ascii<int>("a physical group's dimension");
    const auto tag = in.ascii<int>("a physical group's number");
    const std::size_t begin = in.at();
    const std::string_view text = in.line();
    const std::size_t open = text.find('"'), close = text.rfind('"');
    if (open == std::string_view::npos || close <= open + 1)
      in.fail_at(begin, "expected a name in quotes, found " + Cursor::quoted(text));
    file.physical_names[{dimension, tag}] = std::string(text.substr(open + 1, close - open - 1));
  }
  in.expect_word("$EndPhysicalNames");
  in.binary = binary;
}

// MSH 4.1: what physical groups each geometric entity belongs to.
void read_entities(Cursor& in, MshFile& file) {
  std::size_t counts[4];
  for (std::size_t& count : counts) count = in.count<std::uint64_t>("a number of entities", in.binary ? 36 : 10);
  for (int dimension = 0; dimension < 4; ++dimension)
    for (std::size_t i = 0; i < counts[dimension]; ++i) {
      const auto tag = in.number<std::int32_t>("an entity's number");
      for (int d = 0; d < (dimension == 0 ? 3 : 6); ++d) in.skip_number<double>("an entity's box");
      const std::size_t groups = in.count<std::uint64_t>("an entity's number of physical groups", in.binary ? 4 : 2);
      auto& list = file.physical_of_entity[{dimension, tag}];
      for (std::size_t g = 0; g < groups; ++g)
        list.push_back(group_number(in.number<std::int32_t>("a physical group")));
      if (dimension == 0) continue;
      const std::size_t bounds = in.count<std::uint64_t>("an entity's number of bounding entities", in.binary ? 4 : 2);
      for (std::size_t b = 0; b < bounds; ++b) in.number<std::int32_t>("a bounding entity");
    }
}

void add_node(Cursor& in, MshFile& file, std::size_t slot) {
  const std::size_t begin = in.at();
  for (double& x : file.nodes[slot]) {
    x = in.number<double>("a coordinate");
    if (!std::isfinite(x)) file.not_finite.emplace(slot, begin);
  }
}

void read_nodes_4(Cursor& in, MshFile& file) {
  const std::size_t blocks = in.count<std::uint64_t>("the number of node blocks", in.binary ? 20 : 8);
  const std::size_t total = in.count<std::uint64_t>("the number of nodes", in.binary ? 32 : 8);
  for (int i = 0; i < 2; ++i) in.number<std::uint64_t>("the smallest and largest node number");
  file.node_tags.reserve(total);
  file.nodes.reserve(total);
  for (std::size_t b = 0; b < blocks; ++b) {
    const auto dimension = in.number<std::int32_t>("a node block's dimension");
    in.number<std::int32_t>("a node block's entity");
    const auto parametric = in.number<std::int32_t>("a node block's parametric flag");
    const std::size_t begin = in.at();
    const std::size_t count = in.count<std::uint64_t>("a node block's number of nodes", in.binary ? 32 : 8);
    if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1 || count > total - file.nodes.size())
      in.fail_at(begin,
                 fmt::format("expected a node block of the {} nodes left, found dimension {}, parametric {}, {} nodes",
                             total - file.nodes.size(), dimension, parametric, count));
    const std::size_t first = file.nodes.size();
    for (std::size_t i = 0; i < count; ++i) file.node_tags.push_back(in.number<std::uint64_t>("a node's number"));
    file.nodes.resize(first + count);
    for (std::size_t i = 0; i < count; ++i) {
      add_node(in, file, first + i);
      for (int d = 0; d < parametric * dimension; ++d) in.skip_number<double>("a parametric coordinate");
    }
  }
  if (file.nodes.size() != total)
    in.fail(fmt::format("expected {} nodes in all blocks, found {}", total, file.nodes.size()));
}

void read_nodes_2(Cursor& in, MshFile& file) {
  const bool binary = in.binary;
  in.binary = false;
  const std::size_t total = in.count<std::int64_t>("the number of nodes", binary ? 28 : 8);
  in.line();
  in.binary = binary;
  file.node_tags.reserve(total);
  file.nodes.resize(total);
  for (std::size_t i = 0; i < total; ++i) {
    const std::size_t begin = in.at();
    const auto tag = in.number<std::int32_t>("a node's number");
    if (tag < 1) in.fail_at(begin, fmt::format("expected a positive node number, found {}", tag));
    file.node_tags.push_back(static_cast<std::uint64_t>(tag));
    add_node(in, file, i);
  }
}

// Refuses an element that would leave the body with a hole or with straightened sides.
void check_kind(const Cursor& in, std::size_t at, int type) {
  const bool known = type >= 1 && type < static_cast<int>(std::size(kKinds));
  if (known && (type == kTetrahedron || kKinds[type].dimension < 3)) return;
  if (type == 11 || (type >= 29 && type <= 31))
    in.fail_at(at,
               fmt::format("expected tetrahedra of 4 nodes, found tetrahedra of {}; save the mesh with element order 1",
                           kKinds[type].nodes));
  in.fail_at(at,
             fmt::format("expected points, lines, triangles and tetrahedra, found element type {}; mesh the body with "
                         "tetrahedra alone",
                         type));
}

// Keeps triangles and tetrahedra; counts the rest.
void take_element(MshFile& file, int type, const Element& element) {
  if (type == kTriangle)
    file.triangles.push_back(element);
  else if (type == kTetrahedron)
    file.tetrahedra.push_back(element);
  else
    ++file.ignored;
}

template <class Integer>
void read_element_nodes(Cursor& in, int type, Element& element) {
  for (int n = 0; n < kKinds[type].nodes; ++n) {
    const std::size_t begin = in.at();
    const auto node = in.number<Integer>("an element's node");
    if (node < 1)
      in.fail_at(begin, fmt::format("element {}: expected a positive node number, found {}", element.tag, node));
    if (n < 4) element.nodes[n] = static_cast<std::uint64_t>(node);
  }
}

void read_elements_4(Cursor& in, MshFile& file) {
  const std::size_t blocks = in.count<std::uint64_t>("the number of element blocks", in.binary ? 20 : 8);
  const std::size_t total = in.count<std::uint64_t>("the number of elements", in.binary ? 16 : 4);
  for (int i = 0; i < 2; ++i) in.number<std::uint64_t>("the smallest and largest element number");
  std::size_t seen = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    in.number<std::int32_t>("an element block's dimension");
    const auto entity = in.number<std::int32_t>("an element block's entity");
    const std::size_t begin = in.at();
    const auto type = in.number<std::int32_t>("an element block's type");
    check_kind(in, begin, type);
    const std::size_t bytes = static_cast<std::size_t>(1 + kKinds[type].nodes) * (in.binary ? 8 : 2);
    const std::size_t count = in.count<std::uint64_t>("an element block's number of elements", bytes);
    if (count > total - seen)
      in.fail_at(begin, fmt::format("expected at most {} more elements, found a block of {}", total - seen, count));
    seen += count;
    for (std::size_t i = 0; i < count; ++i) {
      Element element{};
      element.entity = entity;
      element.at = in.at();
      element.tag = in.number<std::uint64_t>("an element's number");
      read_element_nodes<std::uint64_t>(in, type, element);
      take_element(file, type, element);
    }
  }
  if (seen != total) in.fail(fmt::format("expected {} elements in all blocks, found {}", total, seen));
}

// The tags of MSH 2.2: physical group, then geometric entity, then what is not used here.
void read_tags_2(Cursor& in, std::size_t count, Element& element) {
  for (std::size_t t = 0; t < count; ++t) {
    const auto tag = in.number<std::int32_t>("an element's tag");
    if (t == 0) element.physical = group_number(tag);
    if (t == 1) element.entity = tag;
  }
}

void read_elements_2(Cursor& in, MshFile& file) {
  const bool binary = in.binary;
  in.binary = false;
  const std::size_t total = in.count<std::int64_t>("the number of elements", binary ? 8 : 6);
  in.line();
  in.binary = binary;
  for (std::size_t seen = 0; seen < total;) {
    const std::size_t begin = in.at();
    std::uint64_t tag = 0;
    if (!binary) tag = in.ascii<std::uint32_t>("an element's number");
    const auto type = in.number<std::int32_t>("an element's type");
    check_kind(in, begin, type);
    // In binary files elements come in groups that share type and number of tags.
    const std::size_t node_bytes = static_cast<std::size_t>(kKinds[type].nodes) * (binary ? 4 : 2);
    const std::size_t group = binary ? in.count<std::int32_t>("a group's number of elements", 4 + node_bytes) : 1;
    const std::size_t tags = in.count<std::int32_t>("an element's number of tags", binary ? 4 : 2);
    if (group == 0 || group > total - seen)
      in.fail_at(begin, fmt::format("expected a group of 1 to {} elements, found {}", total - seen, group));
    seen += group;
    for (std::size_t i = 0; i < group; ++i) {
      Element element{};
      element.at = binary ? in.at() : begin;
      element.tag = binary ? in.raw<std::uint32_t>("an element's number") : tag;
      read_tags_2(in, tags, element);
      read_element_nodes<std::int32_t>(in, type, element);
      take_element(file, type, element);
    }
  }
}

void once(Cursor& in, bool& seen, std::string_view section) {
  if (seen) in.fail(fmt::format("section {} occurs twice", section));
  seen = true;
}

MshFile read_sections(Cursor& in) {
  MshFile file;
  read_format(in, file);
  bool has_entities = false;
  while (true) {
    const std::string_view section = in.word();
    if (section.empty()) break;
    if (section[0] != '$' || section.starts_with("$End") || section.size() < 2)
      in.fail("expected a section that begins with $, found " + Cursor::quoted(section));
    if (section == "$PhysicalNames") {
      in.line();
      read_physical_names(in, file);
    } else if (section == "$Entities" && file.version_4) {
      once(in, has_entities, section);
      in.line();
      read_entities(in, file);
      in.expect_word("$EndEntities");
    } else if (section == "$Nodes") {
      once(in, file.has_nodes, section);
      in.line();
      file.version_4 ? read_nodes_4(in, file) : read_nodes_2(in, file);
      in.expect_word("$EndNodes");
    } else if (section == "$Elements") {
      once(in, file.has_elements, section);
      in.line();
      file.version_4 ? read_elements_4(in, file) : read_elements_2(in, file);
      in.expect_word("$EndElements");
    } else if (section == "$PartitionedEntities") {
      in.fail("the mesh is partitioned; save it in one part");
    } else {
      in.skip_section(section);
    }
  }
  if (!file.has_nodes || !file.has_elements)
    in.fail(fmt::format("the file ends without section {}", file.has_nodes ? "$Elements" : "$Nodes"));
  return file;
}

// ---- from the sections to a mesh ------------------------------------------------------------------------------------

// Node numbers of the file -> positions in file.nodes.
class NodeLookup {
 public:
  NodeLookup(const Cursor& in, const MshFile& file) : in_(in), count_(file.node_tags.size()) {
    bool in_order = true;
    for (std::size_t i = 0; i < count_ && in_order; ++i) in_order = file.node_tags[i] == i + 1;
    if (in_order) return;
    sorted_.reserve(count_);
    for (std::size_t i = 0; i < count_; ++i) sorted_.emplace_back(file.node_tags[i], i);
    std::sort(sorted_.begin(), sorted_.end());
    for (std::size_t i = 1; i < count_; ++i)
      if (sorted_[i].first == sorted_[i - 1].first) in.fail(fmt::format("node {} is listed twice", sorted_[i].first));
  }

  std::size_t position(std::uint64_t tag, const Element& element) const {
    if (sorted_.empty()) {
      if (tag >= 1 && tag <= count_) return tag - 1;
    } else {
      const auto found = std::lower_bound(sorted_.begin(), sorted_.end(), std::pair{tag, std::size_t{0}});
      if (found != sorted_.end() && found->first == tag) return found->second;
    }
    in_.fail_at(element.at,
                fmt::format("element {} uses node {}, which section $Nodes does not list", element.tag, tag));
  }

 private:
  const Cursor& in_;
  std::size_t count_;
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted_;
};

std::vector<int> physical_groups(const MshFile& file, int dimension, const Element& element) {
  if (!file.version_4) return element.physical == 0 ? std::vector<int>{} : std::vector<int>{element.physical};
  const auto found = file.physical_of_entity.find({dimension, element.entity});
  return found == file.physical_of_entity.end() ? std::vector<int>{} : found->second;
}

std::string group_name(const MshFile& file, int dimension, int tag, const char* otherwise) {
  const auto found = file.physical_names.find({dimension, tag});
  return found == file.physical_names.end() ? fmt::format("{} {}", otherwise, tag) : found->second;
}

// Six times the signed volume.
double sixfold_volume(const TetrahedralMesh& mesh, const std::array<std::int32_t, 4>& t) {
  double e[3][3];
  for (int i = 0; i < 3; ++i)
    for (int d = 0; d < 3; ++d) e[i][d] = mesh.nodes[t[i + 1]][d] - mesh.nodes[t[0]][d];
  return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
         e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
}

// Below this ratio the rounding of the corners' coordinates exceeds the tetrahedron's height, and its stiffness is wrong.
constexpr double kFlattest = 1e-13;

// The distance of a corner from the face opposite, the least of the four, over the longest edge.
double least_height(const TetrahedralMesh& mesh, const std::array<std::int32_t, 4>& t) {
  using Edge = std::array<double, 3>;
  const auto edge = [&](int to, int from) {
    Edge e;
    for (int d = 0; d < 3; ++d) e[d] = mesh.nodes[t[to]][d] - mesh.nodes[t[from]][d];
    return e;
  };
  const auto length = [](const Edge& e) { return std::hypot(e[0], e[1], e[2]); };
  std::array<Edge, 6> edges = {edge(1, 0), edge(2, 0), edge(3, 0), edge(2, 1), edge(3, 1), edge(3, 2)};
  double longest = 0;
  for (const Edge& e : edges) longest = std::max(longest, length(e));
  for (Edge& e : edges)
    for (double& x : e) x /= longest;
  const auto cross = [](const Edge& a, const Edge& b) {
    return Edge{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const Edge face = cross(edges[0], edges[1]);
  double widest = length(face);
  for (const auto& [a, b] : {std::pair{0, 2}, {1, 2}, {3, 4}})
    widest = std::max(widest, length(cross(edges[a], edges[b])));
  return (face[0] * edges[2][0] + face[1] * edges[2][1] + face[2] * edges[2][2]) / widest;
}

// Regions: the physical volume of a tetrahedron, or its geometric volume where it is in no group.
void assign_regions(const Cursor& in, const MshFile& file, TetrahedralMesh& mesh) {
  using RegionKey = std::pair<bool, int>;  // whether geometric, number
  std::map<RegionKey, std::int32_t> regions;
  std::vector<RegionKey> keys;
  keys.reserve(file.tetrahedra.size());
  // Elements come in runs of one entity: look its groups up once per run.
  const Element* last = nullptr;
  RegionKey key;
  for (const Element& element : file.tetrahedra) {
    if (!last || last->entity != element.entity || last->physical != element.physical) {
      const std::vector<int> groups = physical_groups(file, 3, element);
      if (groups.size() > 1)
        in.fail_at(element.at,
                   fmt::format("element {} belongs to the physical volumes {} and {}, expected one; a tetrahedron "
                               "has one material",
                               element.tag, groups[0], groups[1]));
      key = groups.empty() ? RegionKey{true, element.entity} : RegionKey{false, groups[0]};
    }
    last = &element;
    keys.push_back(key);
    regions.emplace(key, 0);
  }
  std::set<std::string> names;
  for (auto& [region, position] : regions) {
    position = static_cast<std::int32_t>(mesh.region_names.size());
    mesh.region_names.push_back(region.first ? fmt::format("region {}", region.second)
                                             : group_name(file, 3, region.second, "region"));
    if (!names.insert(mesh.region_names.back()).second)
      in.fail(fmt::format("two volumes would both be called '{}'; give each physical volume a name of its own",
                          mesh.region_names.back()));
  }
  for (const RegionKey& of_element : keys) mesh.region.push_back(regions[of_element]);
}

// Nodes that a tetrahedron uses, in the file's order; new_position is -1 for the others.
std::vector<std::int32_t> keep_used_nodes(const Cursor& in, const MshFile& file,
                                          const std::vector<std::array<std::size_t, 4>>& tetrahedra,
                                          TetrahedralMesh& mesh) {
  std::vector<std::int32_t> new_position(file.nodes.size(), -1);
  for (const auto& tetrahedron : tetrahedra)
    for (const std::size_t node : tetrahedron) new_position[node] = 0;
  for (const auto& [node, at] : file.not_finite)
    if (new_position[node] == 0) {
      const auto& [x, y, z] = file.nodes[node];
      in.fail_at(at, fmt::format("node {} has the coordinates {}, {} and {}, expected finite ones",
                                 file.node_tags[node], x, y, z));
    }
  for (std::size_t node = 0; node < file.nodes.size(); ++node) {
    if (new_position[node] < 0) continue;
    new_position[node] = static_cast<std::int32_t>(mesh.nodes.size());
    mesh.nodes.push_back(file.nodes[node]);
  }
  return new_position;
}

// Some programs count the nodes of a tetrahedron in the other order.
void turn_if_all_are_reversed(const Cursor& in, TetrahedralMesh& mesh) {
  for (const auto& t : mesh.tetrahedra)
    if (!(sixfold_volume(mesh, t) < 0)) return;
  for (auto& t : mesh.tetrahedra) std::swap(t[2], t[3]);
  note(fmt::format("{}: all {} tetrahedra list their nodes in the other order than gmsh; they were turned", in.name(),
                   mesh.tetrahedra.size()));
}

void assign_patches(const MshFile& file, const NodeLookup& lookup, const std::vector<std::int32_t>& new_position,
                    TetrahedralMesh& mesh, std::uint64_t* dropped) {
  std::map<int, TetrahedralMesh::Patch> patches;
  for (const Element& element : file.triangles) {
    std::array<std::int32_t, 3> triangle{};
    bool used = true;
    for (int i = 0; i < 3; ++i) {
      triangle[i] = new_position[lookup.position(element.nodes[i], element)];
      used = used && triangle[i] >= 0;
    }
    const std::vector<int> groups = physical_groups(file, 2, element);
    if (!used && !groups.empty()) ++*dropped;
    if (!used) continue;
    for (const int group : groups) patches[group].triangles.push_back(triangle);
  }
  for (auto& [tag, patch] : patches) {
    patch.name = group_name(file, 2, tag, "patch");
    mesh.patches.push_back(std::move(patch));
  }
}

TetrahedralMesh assemble(const Cursor& in, const MshFile& file) {
  if (file.nodes.size() > INT32_MAX / 3 || file.tetrahedra.size() > INT32_MAX / 4)
    in.fail(fmt::format("{} nodes and {} tetrahedra are more than 32-bit indices hold", file.nodes.size(),
                        file.tetrahedra.size()));
  if (file.tetrahedra.empty()) in.fail("the file has no tetrahedra; mesh the volume, not the surface alone");

  TetrahedralMesh mesh;
  const NodeLookup lookup(in, file);
  std::vector<std::array<std::size_t, 4>> tetrahedra;
  tetrahedra.reserve(file.tetrahedra.size());
  for (const Element& element : file.tetrahedra) {
    auto& tetrahedron = tetrahedra.emplace_back();
    for (int i = 0; i < 4; ++i) tetrahedron[i] = lookup.position(element.nodes[i], element);
  }
  const std::vector<std::int32_t> new_position = keep_used_nodes(in, file, tetrahedra, mesh);

  mesh.tetrahedra.reserve(tetrahedra.size());
  for (const auto& tetrahedron : tetrahedra) {
    auto& t = mesh.tetrahedra.emplace_back();
    for (int i = 0; i < 4; ++i) t[i] = new_position[tetrahedron[i]];
  }
  turn_if_all_are_reversed(in, mesh);
  for (std::size_t e = 0; e < tetrahedra.size(); ++e) {
    const auto& t = mesh.tetrahedra[e];
    const double volume = sixfold_volume(mesh, t) / 6;
    // Written so that a volume that is not a number is refused as well.
    if (!(volume > 0 && std::isfinite(volume)))
      in.fail_at(
          file.tetrahedra[e].at,
          fmt::format("tetrahedron {} has volume {:.3g}, expected a positive one; its nodes are flat or in the wrong "
                      "order: mesh the body again",
                      file.tetrahedra[e].tag, volume));
    if (const double height = least_height(mesh, t); !(height >= kFlattest))
      in.fail_at(
          file.tetrahedra[e].at,
          fmt::format("tetrahedron {} is flat: its least height is {:.3g} of its longest edge, expected {:.0e} at "
                      "least; mesh the body again",
                      file.tetrahedra[e].tag, height, kFlattest));
  }
  assign_regions(in, file, mesh);
  std::uint64_t dropped = 0;
  assign_patches(file, lookup, new_position, mesh, &dropped);

  if (const std::size_t unused = file.nodes.size() - mesh.nodes.size())
    note(fmt::format("{}: {} nodes that no tetrahedron uses were dropped", in.name(), unused));
  if (dropped > 0)
    warn(fmt::format("{}: {} triangles of named surfaces touch no tetrahedron and were dropped", in.name(), dropped));
  if (file.ignored > 0)
    warn(
        fmt::format("{}: {} elements that are neither triangles nor tetrahedra were ignored", in.name(), file.ignored));
  return mesh;
}

}  // namespace

TetrahedralMesh parse_mesh(std::string_view bytes, const std::string& name) {
  Cursor in(bytes, name);
  const MshFile file = read_sections(in);
  return assemble(in, file);
}

TetrahedralMesh read_mesh(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw InputError(fmt::format("{}: expected a mesh file (.msh), found {}", file.string(),
                                 std::filesystem::exists(file, error) ? "something else" : "nothing"));
  const auto size = std::filesystem::file_size(file, error);
  std::string bytes(error ? 0 : size, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!in) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), std::strerror(errno)));
  return parse_mesh(bytes, file.string());
}

}  // namespace palpate
