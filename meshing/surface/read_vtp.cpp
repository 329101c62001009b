// Reads VTP, VTK's XML format of polygons. VTK reads the file after we have checked the counts in the XML against its
// size.
#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkDataArraySelection.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <charconv>
#include <cmath>

#include "formats/errors.h"
#include "meshing/surface/read_surface_parts.h"

namespace palpate {
namespace {

// Checks every NumberOf...="n" in the XML: compression shrinks an array at most 1032 times.
void check_counts(const std::filesystem::path& file, const std::string& bytes) {
  for (std::size_t at = bytes.find("NumberOf"); at != std::string::npos; at = bytes.find("NumberOf", at + 1)) {
    const std::size_t quote = bytes.find('"', at);
    if (quote == std::string::npos) return;
    std::uint64_t count = 0;
    const auto [end, error] = std::from_chars(bytes.data() + quote + 1, bytes.data() + bytes.size(), count);
    if (error != std::errc() || *end != '"' || count > bytes.size() * 1032) {
      throw InputError(fmt::format("{}: byte {}: {} does not fit a file of {} bytes; it is damaged", file.string(), at,
                                   bytes.substr(at, std::min<std::size_t>(40, quote + 20 - at)), bytes.size()));
    }
  }
}

}  // namespace

StatedSurface read_vtp(const std::filesystem::path& file, const std::string& bytes) {
  if (bytes.substr(0, 4096).find("type=\"PolyData\"") == std::string::npos) {
    throw InputError(fmt::format("{}: expected a VTK XML file of type PolyData", file.string()));
  }
  if (bytes.find("</VTKFile>") == std::string::npos) {
    throw InputError(fmt::format("{}: the file ends without </VTKFile>; it is cut off", file.string()));
  }
  check_counts(file, bytes);
  std::string complaint;
  vtkNew<vtkCallbackCommand> listen;
  listen->SetClientData(&complaint);
  listen->SetCallback([](vtkObject*, unsigned long, void* client, void* text) {
    auto& first = *static_cast<std::string*>(client);
    if (first.empty() && text) first = static_cast<const char*>(text);
  });
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->AddObserver(vtkCommand::ErrorEvent, listen);
  reader->SetFileName(file.c_str());
  reader->UpdateInformation();  // an array that nobody needs may hold what VTK cannot read
  reader->GetPointDataArraySelection()->DisableAllArrays();
  reader->GetCellDataArraySelection()->DisableAllArrays();
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputConnection(reader->GetOutputPort());
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  reader->Update();
  if (!complaint.empty()) {
    const auto colon = complaint.rfind("): ");
    std::string cause = colon == std::string::npos ? complaint : complaint.substr(colon + 3);
    while (!cause.empty() && std::isspace(static_cast<unsigned char>(cause.back()))) cause.pop_back();
    throw InputError(fmt::format("{}: cannot be read: {}", file.string(), cause));
  }
  vtkPolyData* input = reader->GetOutput();
  // check the indices first, because VTK's triangle filter does not
  const auto check = [&](vtkCellArray* cells) {
    vtkNew<vtkIdList> ids;
    for (vtkIdType c = 0; c < cells->GetNumberOfCells(); ++c) {
      cells->GetCellAtId(c, ids);
      for (vtkIdType i = 0; i < ids->GetNumberOfIds(); ++i) {
        if (ids->GetId(i) < 0 || ids->GetId(i) >= input->GetNumberOfPoints()) {
          throw InputError(fmt::format("{}: polygon {}: expected point indices below {}, found {}", file.string(), c,
                                       input->GetNumberOfPoints(), ids->GetId(i)));
        }
      }
    }
  };
  check(input->GetPolys());
  check(input->GetStrips());
  triangles->Update();

  StatedSurface stated;
  TriangleSurface& surface = stated.surface;
  vtkPolyData* output = triangles->GetOutput();
  for (vtkIdType p = 0; p < output->GetNumberOfPoints(); ++p) {
    Point point{};
    output->GetPoint(p, point.data());
    for (const double c : point) {
      if (std::isfinite(c)) continue;
      stated.not_finite.emplace(
          p, fmt::format("{}: point {}: expected finite coordinates, found {}", file.string(), p, c));
    }
    surface.points.push_back(point);
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < output->GetPolys()->GetNumberOfCells(); ++c) {
    output->GetPolys()->GetCellAtId(c, ids);
    std::vector<std::int64_t> corners(ids->begin(), ids->end());
    add_polygon(file, fmt::format("polygon {}", c), corners, surface.points.size(), surface.triangles);
  }
  return stated;
}

}  // namespace palpate
