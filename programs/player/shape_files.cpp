#include "programs/player/shape_files.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkObject.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "programs/player/shown_obstacles.h"

namespace palpate {
namespace {

void write_grid(vtkUnstructuredGrid* grid, const std::filesystem::path& file) {
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(grid);
  writer->SetDataModeToAppended();
  if (writer->Write() != 1 || writer->GetErrorCode() != 0)
    throw OperationError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
}

template <typename Array>
void add_point_data(vtkUnstructuredGrid* grid, vtkNew<Array>& array, const char* name, int components, vtkIdType rows) {
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(rows);
  array->Fill(0);
  grid->GetPointData()->AddArray(array);
}

// cell_nodes: count rows of cell_size node indices.
template <typename Index>
void add_cells(vtkUnstructuredGrid* grid, int cell_type, int cell_size, const Index* cell_nodes, int count) {
  grid->AllocateEstimate(count, cell_size);
  for (int c = 0; c < count; ++c) {
    vtkIdType ids[4] = {};
    for (int i = 0; i < cell_size; ++i) ids[i] = static_cast<vtkIdType>(cell_nodes[c * cell_size + i]);
    grid->InsertNextCell(cell_type, cell_size, ids);
  }
}

// force_of: a tool's, N.
template <typename ForceOf>
void write_tools(const std::vector<std::vector<SceneConfig::Vector>>& tool_points, const ForceOf& force_of,
                 const std::filesystem::path& file) {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  std::vector<int> owner;
  for (std::size_t t = 0; t < tool_points.size(); ++t)
    for (const auto& p : tool_points[t]) {
      const vtkIdType id = points->InsertNextPoint(p.data());
      owner.push_back(static_cast<int>(t));
      grid->InsertNextCell(VTK_VERTEX, 1, &id);
    }
  grid->SetPoints(points);
  vtkNew<vtkIntArray> tool;
  vtkNew<vtkDoubleArray> force;
  const auto rows = static_cast<vtkIdType>(owner.size());
  add_point_data(grid, tool, "tool", 1, rows);
  add_point_data(grid, force, "force", 3, rows);
  for (vtkIdType i = 0; i < rows; ++i) {
    tool->SetValue(i, owner[i]);
    force->SetTuple(i, force_of(owner[i]));
  }
  write_grid(grid, file);
}

// Lines and discs that hold tissue.
struct HeldGrid {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkIntArray> link, tool, condition;
  vtkNew<vtkDoubleArray> tension;

  HeldGrid() {
    points->SetDataTypeToDouble();
    grid->SetPoints(points);
    const auto name = [&](vtkDataArray* array, const char* as) {
      array->SetName(as);
      grid->GetCellData()->AddArray(array);
    };
    name(link, "link"), name(tool, "tool"), name(condition, "condition"), name(tension, "tension");
  }
  void add(int cell_type, const std::vector<std::array<double, 3>>& corners, int of_link, int of_tool, int condition_of,
           double tension_of) {
    std::vector<vtkIdType> ids;
    for (const auto& corner : corners) ids.push_back(points->InsertNextPoint(corner.data()));
    grid->InsertNextCell(cell_type, static_cast<vtkIdType>(ids.size()), ids.data());
    link->InsertNextValue(of_link), tool->InsertNextValue(of_tool), condition->InsertNextValue(condition_of);
    tension->InsertNextValue(tension_of);
  }
};

// The rim of a disc around a point of a deformed triangle, in the triangle's plane.
std::vector<std::array<double, 3>> rim_of(const palpate_bundle* bundle, const float* positions, std::int32_t triangle,
                                          const double* barycentric, double radius) {
  constexpr int kCorners = 24;
  const std::int32_t* node = palpate_bundle_triangles(bundle) + 3 * static_cast<std::ptrdiff_t>(triangle);
  std::array<double, 3> corner[3], middle{}, first{}, second{};
  for (int v = 0; v < 3; ++v)
    for (std::size_t d = 0; d < 3; ++d) {
      corner[v][d] = double{positions[3 * static_cast<std::ptrdiff_t>(node[v]) + static_cast<std::ptrdiff_t>(d)]};
      middle[d] += barycentric[v] * corner[v][d];
    }
  double along = 0, length = 0;  // Gram and Schmidt of two of its edges
  for (std::size_t d = 0; d < 3; ++d) first[d] = corner[1][d] - corner[0][d], length += first[d] * first[d];
  for (std::size_t d = 0; d < 3; ++d) first[d] /= std::sqrt(length), along += first[d] * (corner[2][d] - corner[0][d]);
  length = 0;
  for (std::size_t d = 0; d < 3; ++d)
    second[d] = corner[2][d] - corner[0][d] - along * first[d], length += second[d] * second[d];
  std::vector<std::array<double, 3>> rim;
  for (int c = 0; c < kCorners; ++c) {
    const double angle = 2 * std::numbers::pi * c / kCorners;
    rim.push_back(middle);
    for (std::size_t d = 0; d < 3; ++d)
      rim.back()[d] += radius * (std::cos(angle) * first[d] + std::sin(angle) * second[d] / std::sqrt(length));
  }
  return rim;
}

// The grid is built once; for each shape its points move and its cells stay.
struct MovedGrid {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkFloatArray> positions, displacement;

  void begin(vtkIdType rows) {
    positions->SetNumberOfComponents(3);
    positions->SetNumberOfTuples(rows);
    vtkNew<vtkPoints> points;
    points->SetData(positions);
    grid->SetPoints(points);
    add_point_data(grid, displacement, "displacement", 3, rows);
  }
  void begin(const RenderMesh& mesh) {
    add_cells(grid, VTK_TRIANGLE, 3, mesh.indices.data(), static_cast<int>(mesh.indices.size() / 3));
    begin(static_cast<vtkIdType>(mesh.positions.size() / 3));
  }
  // count: of numbers.
  void move(const float* now, const float* rest, std::size_t count) {
    std::copy_n(now, count, positions->GetPointer(0));
    std::transform(now, now + count, rest, displacement->GetPointer(0), std::minus<>());
  }
  void moved() {
    positions->Modified();
    grid->GetPoints()->Modified();
  }
};

// The render mesh.
struct Skin : MovedGrid {
  vtkNew<vtkFloatArray> normals;
  const RenderMesh& mesh;

  explicit Skin(const RenderMesh& of) : mesh(of) {
    begin(mesh);
    add_point_data(grid, normals, "normal", 3, positions->GetNumberOfTuples());
  }
  void move_to(const ShapeRecord& shape) {
    move(shape.skin_positions, mesh.positions.data(), mesh.positions.size());
    std::copy_n(shape.skin_normals, mesh.positions.size(), normals->GetPointer(0));
    moved();
  }
};

// A carried surface.
struct CarriedGrid : MovedGrid {
  const OrganInside::Carried& carried;

  explicit CarriedGrid(const OrganInside::Carried& of) : carried(of) { begin(of.mesh); }
  template <typename Frame>
  void move_in(const Frame& frame) {
    const std::size_t rows = carried.mesh.positions.size() / 3;
    move(carried.positions.data(), carried.rest.data(), 3 * rows);
    frame.put_points(positions->GetPointer(0), rows), frame.put_vectors(displacement->GetPointer(0), rows);
    moved();
  }
};

// Strain and stress as point data. ParaView knows a tensor by its six components.
struct InsideData {
  vtkNew<vtkFloatArray> strain, stress, pressure, von_mises, principal;

  InsideData(vtkUnstructuredGrid* grid, vtkIdType rows) {
    add_point_data(grid, strain, "strain", 6, rows);
    add_point_data(grid, stress, "stress", 6, rows);
    add_point_data(grid, pressure, "pressure", 1, rows);
    add_point_data(grid, von_mises, "von_mises", 1, rows);
    add_point_data(grid, principal, "principal_stress", 3, rows);
    for (vtkFloatArray* tensor : {strain.Get(), stress.Get()}) {
      static const char* const names[] = {"XX", "YY", "ZZ", "XY", "YZ", "XZ"};
      for (int i = 0; i < 6; ++i) tensor->SetComponentName(i, names[i]);
    }
  }
  template <typename Frame>
  void take(const palpate_inside_out& field, const Frame& frame) {
    const auto rows = static_cast<std::size_t>(field.count);
    std::copy_n(field.strains, 6 * rows, strain->GetPointer(0));
    std::copy_n(field.stresses, 6 * rows, stress->GetPointer(0));
    std::copy_n(field.pressures, rows, pressure->GetPointer(0));
    std::copy_n(field.von_mises, rows, von_mises->GetPointer(0));
    std::copy_n(field.principal, 3 * rows, principal->GetPointer(0));
    frame.put_tensors(strain->GetPointer(0), rows), frame.put_tensors(stress->GetPointer(0), rows);
  }
};

// Where an organ's frame is in the world; without one both are the same.
class Frame {
 public:
  explicit Frame(const palpate_pose* pose = nullptr)
      : moved_(pose != nullptr), pose_(pose ? *pose : palpate_default_pose()) {}
  // In place: count rows of three.
  void put_points(float* numbers, std::size_t count) const {
    each(numbers, count, [this](double* p) { palpate_point_to_world(pose_.position, pose_.orientation, p, p); });
  }
  template <typename Number>
  void put_vectors(Number* numbers, std::size_t count) const {
    each(numbers, count, [this](double* v) { palpate_vector_to_world(pose_.orientation, v, v); });
  }
  // In place: count rows of xx yy zz xy yz xz. Turns the columns of the tensor, and then its rows.
  void put_tensors(float* numbers, std::size_t count) const {
    static const int at[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (std::size_t n = 0; moved_ && n < count; ++n) {
      float* const tensor = numbers + 6 * n;
      double turned[3][3], column[3];
      for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 3; ++i) column[i] = double{tensor[at[i][k]]};
        palpate_vector_to_world(pose_.orientation, column, column);
        for (int i = 0; i < 3; ++i) turned[i][k] = column[i];
      }
      for (auto& row : turned) palpate_vector_to_world(pose_.orientation, row, row);
      for (int i = 0; i < 3; ++i)
        for (int k = i; k < 3; ++k) tensor[at[i][k]] = static_cast<float>(turned[i][k]);
    }
  }
  std::array<double, 3> point(const double* in_organ) const {
    std::array<double, 3> p = {in_organ[0], in_organ[1], in_organ[2]};
    if (moved_) palpate_point_to_world(pose_.position, pose_.orientation, p.data(), p.data());
    return p;
  }

 private:
  template <typename Number, typename Put>
  void each(Number* numbers, std::size_t count, const Put& put) const {
    for (std::size_t i = 0; moved_ && i < count; ++i) {
      double row[3] = {double{numbers[3 * i]}, double{numbers[3 * i + 1]}, double{numbers[3 * i + 2]}};
      put(row);
      for (std::size_t d = 0; d < 3; ++d) numbers[3 * i + d] = static_cast<Number>(row[d]);
    }
  }
  bool moved_;
  palpate_pose pose_;
};

// Its shaft, from the tip to the handle. The tip is in the world.
void add_needle(const PlayedOrgan& organ, std::size_t tool, HeldGrid& held) {
  const palpate_needle* needle = organ.needles().of(tool);
  const palpate_needle_state* state =
      needle ? palpate_scene_needle_state(organ.runtime_scene(), static_cast<std::int32_t>(tool)) : nullptr;
  if (!state || state->condition == PALPATE_NEEDLE_NONE) return;
  std::array<double, 3> tip{}, end{};
  for (std::size_t d = 0; d < 3; ++d) {
    tip[d] = needle->tip[d];
    end[d] = tip[d] - organ.needles().drawn_length(tool) * needle->direction[d];
  }
  held.add(VTK_LINE, {tip, end}, -1, static_cast<int>(tool), state->condition, 0);
}

// Their ends are in the world.
void write_links_between_organs(const WorldPlayer& player, const std::filesystem::path& file) {
  HeldGrid held;
  const auto& stretches = player.links().stretches();
  for (std::size_t s = 0; s < stretches.size(); ++s)
    if (const palpate_link_state* state =
            palpate_world_link_state(player.runtime_world(), static_cast<std::int32_t>(s)))
      held.add(VTK_LINE, {std::to_array(state->ends[0]), std::to_array(state->ends[1])},
               static_cast<int>(stretches[s].link), -1, state->condition, state->tension);
  write_grid(held.grid, file);
}

void write_held(const PlayedOrgan& organ, const Frame& frame, const float* positions,
                const std::filesystem::path& file) {
  HeldGrid held;
  const HeldTissue& tissue = organ.held();
  for (std::size_t s = 0; s < tissue.stretches().size(); ++s)
    if (const palpate_link_state* state = palpate_scene_link_state(organ.runtime_scene(), static_cast<std::int32_t>(s)))
      held.add(VTK_LINE, {frame.point(state->ends[0]), frame.point(state->ends[1])},
               static_cast<int>(tissue.stretches()[s].link), -1, state->condition, state->tension);
  for (std::size_t t = 0; t < organ.scene().tools.size(); ++t) {
    const palpate_grasp* grasp = tissue.grasp(t);
    const palpate_grasp_state* state =
        grasp ? palpate_scene_grasp_state(organ.runtime_scene(), static_cast<std::int32_t>(t)) : nullptr;
    if (!state || state->condition == PALPATE_GRASP_OPEN || state->condition == PALPATE_GRASP_LET_GO) continue;
    const auto add = [&](std::int32_t triangle, const double* barycentric) {
      held.add(VTK_POLYGON, rim_of(organ.bundle(), positions, triangle, barycentric, grasp->radius), -1,
               static_cast<int>(t), state->condition, 0);
    };
    add(grasp->triangle, grasp->barycentric);
    if (grasp->opposite_triangle >= 0) add(grasp->opposite_triangle, grasp->opposite_barycentric);
  }
  for (std::size_t t = 0; t < organ.scene().tools.size(); ++t) add_needle(organ, t, held);
  write_grid(held.grid, file);
}

// A vertex for each load, where its patch is now; the state is in the world.
void write_loads(const PlayedOrgan& organ, const std::filesystem::path& file) {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkDoubleArray> force, displacement;
  vtkNew<vtkIntArray> load;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  const auto rows = static_cast<vtkIdType>(organ.loads().count());
  for (vtkIdType i = 0; i < rows; ++i)
    if (const palpate_load_state* state = OrganLoads::state(organ.runtime_scene(), static_cast<std::size_t>(i))) {
      const vtkIdType at = points->InsertNextPoint(state->place);
      grid->InsertNextCell(VTK_VERTEX, 1, &at);
    }
  add_point_data(grid, load, "load", 1, rows);
  add_point_data(grid, force, "force", 3, rows);
  add_point_data(grid, displacement, "displacement", 3, rows);
  for (vtkIdType i = 0; i < rows; ++i)
    if (const palpate_load_state* state = OrganLoads::state(organ.runtime_scene(), static_cast<std::size_t>(i))) {
      load->SetValue(i, static_cast<int>(i));
      force->SetTuple(i, state->force), displacement->SetTuple(i, state->displacement);
    }
  write_grid(grid, file);
}

// A line for each blade that is there. Edges are in the world.
void write_blades(const OrganCuts& cuts, const std::filesystem::path& file) {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkIntArray> blade;
  points->SetDataTypeToDouble();
  grid->SetPoints(points);
  blade->SetName("blade");
  grid->GetCellData()->AddArray(blade);
  for (std::size_t i = 0; i < cuts.blade_count(); ++i) {
    std::vector<vtkIdType> ids;
    for (const auto& point : cuts.edge(i)) ids.push_back(points->InsertNextPoint(point.data()));
    if (ids.empty()) continue;
    grid->InsertNextCell(VTK_POLY_LINE, static_cast<vtkIdType>(ids.size()), ids.data());
    blade->InsertNextValue(static_cast<int>(i));
  }
  write_grid(grid, file);
}

}  // namespace

// The surfaces of all obstacles, in the world. The cells stay, and the points move.
struct ShapeFiles::Obstacles {
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkIntArray> obstacle;
  vtkNew<vtkDoubleArray> force;
  std::vector<ShownObstacle> shown;

  explicit Obstacles(std::vector<ShownObstacle> of) : shown(std::move(of)) {
    points->SetDataTypeToDouble();
    grid->SetPoints(points);
    vtkIdType rows = 0;
    std::vector<vtkIdType> corners;
    for (const ShownObstacle& one : shown) {
      for (const std::uint32_t corner : one.surface->indices) corners.push_back(rows + corner);
      rows += static_cast<vtkIdType>(one.surface->positions.size() / 3);
    }
    add_cells(grid, VTK_TRIANGLE, 3, corners.data(), static_cast<int>(corners.size() / 3));
    points->SetNumberOfPoints(rows);
    add_point_data(grid, obstacle, "obstacle", 1, rows);
    add_point_data(grid, force, "force", 3, rows);
  }
  void move() {
    vtkIdType row = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const palpate_obstacle_state state = shown[i].state();
      const std::vector<float>& own = shown[i].surface->positions;
      for (std::size_t at = 0; at < own.size(); at += 3, ++row) {
        double p[3] = {double{own[at]}, double{own[at + 1]}, double{own[at + 2]}};
        palpate_point_to_world(state.position, state.orientation, p, p);
        points->SetPoint(row, p), obstacle->SetValue(row, static_cast<int>(i)), force->SetTuple(row, state.force);
      }
    }
    points->Modified();
  }
};

struct ShapeFiles::Organ : MovedGrid {
  vtkNew<vtkDoubleArray> contact_force;
  vtkNew<vtkUnsignedCharArray> fixed, crosses, lip;
  vtkNew<vtkIntArray> region;

  const PlayedOrgan& of;
  std::string name;  // in the names of its files
  Frame frame;
  std::unique_ptr<Skin> skin;          // with a render mesh
  std::unique_ptr<InsideData> inside;  // where the scene looks inside
  PresentSurface cut;
  std::vector<std::unique_ptr<CarriedGrid>> carried;

  Organ(const PlayedOrgan& organ, const BundleFields& fields, std::string file_name, const Frame& in_world)
      : of(organ), name(std::move(file_name)), frame(in_world) {
    if (of.render_mesh()) skin = std::make_unique<Skin>(*of.render_mesh());
    if (of.scene().def.shape == PALPATE_SHAPE_OFF) return;
    const palpate_bundle_info info = palpate_bundle_describe(of.bundle());
    const bool volume = of.scene().def.shape == PALPATE_SHAPE_VOLUME;
    const vtkIdType rows = volume ? info.node_count : info.surface_node_count;
    if (of.is_cut())
      lip->SetName("lip"), grid->GetCellData()->AddArray(lip);
    else if (volume)
      add_cells(grid, VTK_TETRA, 4, palpate_bundle_tetrahedra(of.bundle()), info.tetrahedron_count);
    else
      add_cells(grid, VTK_TRIANGLE, 3, palpate_bundle_triangles(of.bundle()), info.triangle_count);
    begin(rows);
    add_point_data(grid, contact_force, "contact_force", 3, rows);
    add_point_data(grid, fixed, "fixed", 1, rows);
    for (vtkIdType n = 0; n < rows; ++n) {
      const auto* dof = fields.fixed.data() + 3 * n;
      fixed->SetValue(n, dof[0] && dof[1] && dof[2] ? 1 : 0);
    }
    if (volume && !of.is_cut()) add_region(fields);
    if (of.crossings()) add_point_data(grid, crosses, "crosses", 1, rows);
    if (!of.inside()) return;
    inside = std::make_unique<InsideData>(grid, rows);
    for (const OrganInside::Carried& surface : of.inside()->carried())
      carried.push_back(std::make_unique<CarriedGrid>(surface));
  }

  void add_region(const BundleFields& fields) {
    region->SetName("region");
    for (const std::int32_t r : fields.region) region->InsertNextValue(r);
    grid->GetCellData()->AddArray(region);
  }

  // The cells of an organ whose surface a cut has changed.
  void take_cut() {
    const std::vector<std::uint8_t>& is_lip = cut.is_lip();
    add_cells(grid, VTK_TRIANGLE, 3, cut.triangles().data(), static_cast<int>(is_lip.size()));
    lip->SetNumberOfTuples(static_cast<vtkIdType>(is_lip.size()));
    std::copy(is_lip.begin(), is_lip.end(), lip->GetPointer(0));
    lip->Modified();
    std::vector<std::int32_t> made(2 *
                                   static_cast<std::size_t>(palpate_scene_cut_nodes(of.runtime_scene(), nullptr, 0)));
    palpate_scene_cut_nodes(of.runtime_scene(), made.data(), static_cast<std::int32_t>(made.size() / 2));
    for (std::size_t i = 0; i < made.size(); i += 2) fixed->SetValue(made[i], fixed->GetValue(made[i + 1]));
    fixed->Modified();
  }

  // The corners of the triangles that cross.
  void mark(const palpate_crossings_out& found) {
    crosses->Fill(0);
    for (std::int32_t i = 0; i < found.count; ++i)
      for (const std::int32_t triangle : found.crossings[i].triangle)
        for (int v = 0; v < 3; ++v) crosses->SetValue(palpate_bundle_triangles(of.bundle())[3 * triangle + v], 1);
    crosses->Modified();
  }

  void move_to(const ShapeRecord& shape) {
    if (cut.follow(of.runtime_scene())) take_cut();
    const std::size_t values = 3 * static_cast<std::size_t>(shape.node_count);
    std::copy_n(shape.positions, values, positions->GetPointer(0));
    std::copy_n(shape.displacements, values, displacement->GetPointer(0));
    contact_force->Fill(0);
    // A needle also holds nodes inside the organ, which a shape of the surface does not have.
    const palpate_contact_node* nodes = palpate_contacts_node(&shape.contacts, 0);
    for (int n = 0; n < shape.contacts.node_count; ++n)
      for (int d = 0; nodes[n].node < shape.node_count && d < 3; ++d)
        *contact_force->GetPointer(3 * static_cast<vtkIdType>(nodes[n].node) + d) += nodes[n].force[d];
    const auto rows = static_cast<std::size_t>(shape.node_count);
    frame.put_points(positions->GetPointer(0), rows), frame.put_vectors(displacement->GetPointer(0), rows);
    frame.put_vectors(contact_force->GetPointer(0), rows);
    if (shape.crossings) mark(shape.crossings->found());
    if (shape.inside) {
      inside->take(shape.inside->field(), frame);
      for (const auto& surface : carried) surface->move_in(frame);
    }
    moved();
  }
};

ShapeFiles::ShapeFiles(const std::filesystem::path& folder) : folder_(folder) {
  vtkObject::GlobalWarningDisplayOff();  // failures are reported here, in one sentence
  std::filesystem::create_directory(folder_ / "shapes");
}

ShapeFiles::ShapeFiles(const std::filesystem::path& folder, const Player& player,
                       const std::vector<BundleFields>& fields)
    : ShapeFiles(folder) {
  organs_.push_back(std::make_unique<Organ>(player.organ(), fields[0], "", Frame()));
  begin_obstacles();
}

ShapeFiles::ShapeFiles(const std::filesystem::path& folder, const WorldPlayer& player,
                       const std::vector<BundleFields>& fields)
    : ShapeFiles(folder) {
  world_ = &player;
  for (std::size_t k = 0; k < player.organ_count(); ++k)
    organs_.push_back(std::make_unique<Organ>(player.organ(k), fields[k], '_' + player.scene().organs[k].name,
                                              Frame(&player.pose(k))));
  begin_obstacles();
}

ShapeFiles::~ShapeFiles() = default;

void ShapeFiles::begin_obstacles() {
  std::vector<const PlayedOrgan*> organs;
  for (const auto& organ : organs_) organs.push_back(&organ->of);
  if (std::vector<ShownObstacle> shown = shown_obstacles(organs); !shown.empty())
    obstacles_ = std::make_unique<Obstacles>(std::move(shown));
}

void ShapeFiles::write_obstacles(std::vector<std::string>& parts) const {
  if (!obstacles_) return;
  obstacles_->move();
  write_grid(obstacles_->grid, folder_ / parts.emplace_back(fmt::format("shapes/obstacles_{:06}.vtu", written_)));
}

void ShapeFiles::write_organ(Organ& organ, const ShapeRecord& shape, std::vector<std::string>& parts) const {
  const auto next = [&](const char* kind) {
    return folder_ / parts.emplace_back(fmt::format("shapes/{}{}_{:06}.vtu", kind, organ.name, written_));
  };
  organ.move_to(shape);
  write_grid(organ.grid, next("organ"));
  if (organ.skin) {
    organ.skin->move_to(shape);
    write_grid(organ.skin->grid, next("skin"));
  }
  for (const auto& surface : organ.carried)
    write_grid(surface->grid, next(fmt::format("carried_{}", surface->carried.name).c_str()));
  if (organ.of.holds_tissue() || organ.of.has_needles())
    write_held(organ.of, organ.frame, organ.positions->GetPointer(0), next("held"));
  if (organ.of.loads().any()) write_loads(organ.of, next("loads"));
  if (organ.of.cuts().blade_count() > 0) write_blades(organ.of.cuts(), next("blades"));
}

void ShapeFiles::write(const ShapeRecord& shape) {
  std::vector<std::string> parts;
  write_organ(*organs_[0], shape, parts);
  parts.insert(parts.begin() + 1, fmt::format("shapes/tools_{:06}.vtu", written_));
  write_tools(
      shape.points, [&](int tool) { return palpate_contacts_tool(&shape.contacts, tool)->force; }, folder_ / parts[1]);
  write_obstacles(parts);
  add_entries(shape.time, parts);
}

void ShapeFiles::write(const WorldShapeRecord& shapes) {
  std::vector<std::string> parts = {fmt::format("shapes/tools_{:06}.vtu", written_)};
  write_tools(
      shapes.organs[0].points, [&](int tool) { return palpate_world_contacts_tool(&shapes.contacts, tool)->force; },
      folder_ / parts[0]);
  for (std::size_t k = 0; k < organs_.size(); ++k)
    if (shapes.organs[k].node_count > 0) write_organ(*organs_[k], shapes.organs[k], parts);
  if (!world_->links().empty())
    write_links_between_organs(*world_, folder_ / parts.emplace_back(fmt::format("shapes/links_{:06}.vtu", written_)));
  write_obstacles(parts);
  add_entries(shapes.organs[0].time, parts);
}

void ShapeFiles::add_entries(double time, const std::vector<std::string>& parts) {
  for (std::size_t part = 0; part < parts.size(); ++part)
    entries_ += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" file=\"{}\"/>\n", time, part, parts[part]);
  ++written_;
}

void ShapeFiles::close() {
  write_text_atomically(folder_ / "shapes.pvd",
                        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n" +
                            entries_ + "  </Collection>\n</VTKFile>\n");
}

}  // namespace palpate
