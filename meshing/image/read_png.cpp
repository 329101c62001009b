#include "meshing/image/read_png.h"

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstdio>

#include "formats/errors.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

// libpng reports errors by longjmp, which runs no destructors: the functions between keep none.
class Png {
 public:
  explicit Png(const std::filesystem::path& file) : file_(std::fopen(file.c_str(), "rb")) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, keep_error, [](png_structp, png_const_charp) {});
    info_ = png_ ? png_create_info_struct(png_) : nullptr;
  }
  ~Png() {
    png_destroy_read_struct(&png_, &info_, nullptr);
    if (file_) std::fclose(file_);
  }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  // Both false where libpng refuses the file; error() then says why.
  bool read_header() {
    if (!file_ || !info_) return false;
    if (setjmp(png_jmpbuf(png_))) return false;
    png_init_io(png_, file_);
    png_read_info(png_, info_);
    png_set_packing(png_);  // of 1, 2 or 4 bits: a byte each, the number as it is
    png_set_swap(png_);     // of 16 bits: the order of this machine
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }
  bool read_rows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_))) return false;
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }
  // Colours by a palette are three channels.
  int channels() const {
    const bool palette = (png_get_color_type(png_, info_) & PNG_COLOR_MASK_PALETTE) != 0;
    return (palette ? 3 : png_get_channels(png_, info_)) + (png_get_valid(png_, info_, PNG_INFO_tRNS) ? 1 : 0);
  }
  bool of_two_bytes() const { return png_get_bit_depth(png_, info_) == 16; }
  std::size_t row_bytes() const { return png_get_rowbytes(png_, info_); }
  const char* error() const { return error_; }

 private:
  static void keep_error(png_structp png, png_const_charp message) {
    std::snprintf(static_cast<Png*>(png_get_error_ptr(png))->error_, sizeof error_, "%s", message);
    png_longjmp(png, 1);
  }

  std::FILE* file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  char error_[100] = "it cannot be opened";
};

}  // namespace

LabelImage read_png_slice(const std::filesystem::path& file) {
  const auto [width, height] = read_png_header(file);
  Png png(file);
  const auto refuse = [&] { return InputError(fmt::format("{}: cannot be read: {}", file.string(), png.error())); };
  if (!png.read_header()) throw refuse();
  if (png.channels() != 1)
    throw InputError(
        fmt::format("{}: expected one value per voxel, found {}; extract one", file.string(), png.channels()));
  const auto rows_high = static_cast<std::size_t>(height);
  std::vector<png_byte> bytes(rows_high * png.row_bytes());
  std::vector<png_bytep> rows;
  for (std::size_t row = 0; row < rows_high; ++row) rows.push_back(bytes.data() + row * png.row_bytes());
  if (!png.read_rows(rows.data())) throw refuse();
  LabelImage image;
  image.grid.size = {width, height, 1};
  image.grid.axis = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (const png_byte* row : rows)
    for (int x = 0; x < width; ++x)
      image.values.push_back(png.of_two_bytes() ? reinterpret_cast<const png_uint_16*>(row)[x] : row[x]);
  return image;
}

}  // namespace palpate
