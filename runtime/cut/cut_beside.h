// A cut body under large deformation that is solved beside the touch: its mesh, surface and compliance, in the thread of the body. The touch has those of
// cut_organ.h, and tells by a stream.
#pragma once

#include <cstdint>

#include "runtime/cut/cut_large.h"
#include "runtime/cut/cut_stream.h"
#include "runtime/surface/node_fans.h"

namespace palpate {

class CutBeside final : public MeshStream {
 public:
  // surface: as it is before any cut. rest: [nodes of the surface][3] m. Both are copied. False where memory ends.
  bool create(SceneMemory& memory, const CutLarge::Parts& parts, const CutTriangles& surface, const double* rest);
  CutStream& stream() { return stream_; }

  std::int32_t end() const override { return stream_.end(); }
  std::int32_t copy(std::int32_t from, std::int32_t most, std::int32_t* out) const override {
    return stream_.copy(from, most, out);
  }
  void follow(const std::int32_t* numbers, std::int32_t count, bool replayed) override;
  void forget() override;
  Surface surface() const override { return {rest_, triangles_, &fans_}; }
  void restore(std::int32_t count) override;

  // Of follow(), for CutStream::read().
  void split(const CutChange& change);
  void remove(std::int32_t tetrahedron);
  void hold(std::int32_t node, double stiffness) { body_.ground(node, stiffness, replayed_); }
  void triangle(std::int32_t number, const std::int32_t* corners, bool is_active);

 private:
  CutStream stream_;  // of the touch
  CutLarge body_;
  NodeFans fans_;
  std::int32_t nodes_ = 0, triangle_count_ = 0;
  double* rest_ = nullptr;
  std::int32_t *triangles_ = nullptr, *uncut_ = nullptr;
  std::uint8_t *active_ = nullptr, *uncut_active_ = nullptr;
  bool replayed_ = false, shows_ = false;
};

}  // namespace palpate
