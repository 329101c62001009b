// Reads and writes files of triangle surfaces.
#pragma once

#include <filesystem>
#include <string>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Chooses the format by the extension: .off and .obj (text, 17 digits), .ply (binary, double precision) or .stl
// (binary, single precision, because the format has no other). Writes the file under another name first, so that a
// failure leaves no partial file. Does not change coordinates. Formats with comments get the comment "LPS mm".
// Errors: InputError for another extension, OperationError when writing fails.
void write_surface(const std::filesystem::path& file, const TriangleSurface& surface);
void check_output_name(const std::filesystem::path& file);

// Reads .off, .obj, .ply (text, binary) and .stl (text, binary) and multiplies the coordinates by
// millimetres_per_unit. Does not repair: points may be repeated; triangles may be flat, turned or leave holes. Cuts
// polygons into fans of triangles. Errors: InputError that names the line or byte, for a coordinate that is not a
// finite number, an index out of range, counts that do not fit the size of the file, a file that ends early, or no
// triangles.
TriangleSurface read_surface(const std::filesystem::path& file, double millimetres_per_unit);

}  // namespace palpate
