#include "tests/meshing/surface_images.h"

namespace palpate::tests {

ShapeImage shape_image(std::array<int, 3> size, std::array<Point, 3> axis, Point middle,
                       const std::function<int(const Point&)>& shape) {
  ShapeImage image;
  image.grid.size = size;
  image.grid.axis = axis;
  image.grid.origin = middle;
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 3; ++c) image.grid.origin[c] -= 0.5 * (size[a] - 1) * axis[a][c];
  }
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        Point p = image.grid.point(i, j, k);
        for (int c = 0; c < 3; ++c) p[c] -= middle[c];
        image.values.push_back(static_cast<std::uint8_t>(shape(p)));
      }
    }
  }
  return image;
}

ShapeImage upright_image(std::array<int, 3> size, const std::function<int(const Point&)>& shape) {
  return shape_image(size, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {}, shape);
}

LabelImage labels_of(const ShapeImage& image) {
  return {image.grid, {image.values.begin(), image.values.end()}, {}};
}

std::array<Point, 3> turned_axes(Point spacing, double degrees) {
  const double c = std::cos(degrees * M_PI / 180), s = std::sin(degrees * M_PI / 180);
  std::array<Point, 3> axes = {{{c, s * c, s * s}, {-s, c * c, c * s}, {0, -s, c}}};
  for (int a = 0; a < 3; ++a) {
    for (double& x : axes[a]) x *= spacing[a];
  }
  return axes;
}

std::function<int(const Point&)> ellipsoid(double a, double b, double c, int label) {
  return [=](const Point& p) {
    return p[0] * p[0] / (a * a) + p[1] * p[1] / (b * b) + p[2] * p[2] / (c * c) < 1 ? label : 0;
  };
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string gzipped(const std::string& bytes) {
  std::string packed(compressBound(bytes.size()) + 64, '\0');
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<unsigned>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<unsigned>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.erase(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string voxel_bytes(const ShapeImage& image) {
  return {image.values.begin(), image.values.end()};
}

std::string triple(const Point& p) {
  char text[120];
  std::snprintf(text, sizeof text, "%.17g %.17g %.17g", p[0], p[1], p[2]);
  return text;
}

std::string sizes_of(const ShapeImage& image) {
  return std::to_string(image.grid.size[0]) + " " + std::to_string(image.grid.size[1]) + " " +
         std::to_string(image.grid.size[2]);
}

std::string as_nrrd(const ShapeImage& image, bool ras, bool gzip) {
  const auto vector = [&](Point p) {
    if (ras) p = {-p[0], -p[1], p[2]};
    std::string text = "(";
    text.append(triple(p)).append(")");
    for (char& c : text) c = c == ' ' ? ',' : c;
    return text;
  };
  std::string head = "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: ";
  head += ras ? "right-anterior-superior" : "left-posterior-superior";
  head += "\nsizes: " + sizes_of(image) + "\nspace directions: " + vector(image.grid.axis[0]) + " " +
          vector(image.grid.axis[1]) + " " + vector(image.grid.axis[2]) +
          "\nkinds: domain domain domain\nencoding: " + (gzip ? "gzip" : "raw") +
          "\nspace origin: " + vector(image.grid.origin) + "\n\n";
  return head + (gzip ? gzipped(voxel_bytes(image)) : voxel_bytes(image));
}

std::string as_meta(const ShapeImage& image) {
  const Point spacing = image.grid.spacing();
  std::string directions;
  for (int a = 0; a < 3; ++a) {
    Point unit = image.grid.axis[a];
    for (double& x : unit) x /= spacing[a];
    directions.append(" ").append(triple(unit));
  }
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
         "TransformMatrix =" +
         directions + "\nOffset = " + triple(image.grid.origin) +
         "\nCenterOfRotation = 0 0 0\n"
         "ElementSpacing = " +
         triple(spacing) + "\nDimSize = " + sizes_of(image) + "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
         voxel_bytes(image);
}

std::string as_nifti(const ShapeImage& image, int unit) {
  const double per_mm = unit == 1 ? 1e-3 : unit == 3 ? 1e3 : 1;
  std::string head(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(head.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  for (std::size_t d = 0; d < 7; ++d) put(42 + 2 * d, static_cast<std::int16_t>(d < 3 ? image.grid.size[d] : 1));
  put(70, std::int16_t{2});  // unsigned char
  put(72, std::int16_t{8});
  put(76, 1.0f);
  for (std::size_t d = 0; d < 3; ++d) put(80 + 4 * d, static_cast<float>(per_mm * image.grid.spacing()[d]));
  put(108, 352.0f);
  put(112, 1.0f);
  head[123] = static_cast<char>(unit);
  put(254, std::int16_t{1});  // sform_code: scanner
  for (std::size_t row = 0; row < 3; ++row) {
    const double sign = row < 2 ? -per_mm : per_mm;  // LPS -> RAS
    for (std::size_t a = 0; a < 3; ++a) put(280 + 16 * row + 4 * a, static_cast<float>(sign * image.grid.axis[a][row]));
    put(280 + 16 * row + 12, static_cast<float>(sign * image.grid.origin[row]));
  }
  std::memcpy(head.data() + 344, "n+1", 4);
  return head + voxel_bytes(image);
}

std::string as_inr(const ShapeImage& image) {
  const Point s = image.grid.spacing(), o = image.grid.origin;
  const auto text = [](double x) { return triple({x, 0, 0}).substr(0, triple({x, 0, 0}).find(' ')); };
  std::string head = "#INRIMAGE-4#{\nXDIM=" + std::to_string(image.grid.size[0]) +
                     "\nYDIM=" + std::to_string(image.grid.size[1]) + "\nZDIM=" + std::to_string(image.grid.size[2]) +
                     "\nVDIM=1\nVX=" + text(s[0]) + "\nVY=" + text(s[1]) + "\nVZ=" + text(s[2]) + "\nTX=" + text(o[0]) +
                     "\nTY=" + text(o[1]) + "\nTZ=" + text(o[2]) +
                     "\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\nCPU=pc\n";
  head.resize(252, '\n');
  return head + "##}\n" + voxel_bytes(image);
}

}  // namespace palpate::tests
