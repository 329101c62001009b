// Triangle surfaces on disk.
#pragma once

#include <filesystem>
#include <string>

#include "meshing/surface/triangle_surface.h"

namespace palpate {

// By extension, atomically: .off and .obj (text, 17 digits), .ply (binary, double), .stl (binary, single precision: the
// format has no other). Coordinates are written as they are; a comment, where the format has one, says "LPS mm".
// Errors: InputError for another extension, OperationError for the disk.
void write_surface(const std::filesystem::path& file, const TriangleSurface& surface);
void check_output_name(const std::filesystem::path& file);

// Triangles as a file has them: points may repeat, triangles may be open, flat or turned. Polygons are cut into fans.
// .off .obj .ply (text, binary) .stl (text, binary, whatever its header begins with) .vtp. Coordinates times
// millimetres_per_unit.
// Errors: InputError with the line or byte: not a number or not finite, an index out of range, counts that do not fit
// the file's size, a file that ends early, no triangles.
TriangleSurface read_surface(const std::filesystem::path& file, double millimetres_per_unit);

}  // namespace palpate
