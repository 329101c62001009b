// Owners of a bundle's bytes, an open bundle and a scene.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "runtime/include/palpate/palpate.h"

namespace palpate::tests {

struct BundleCloser {
  void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
};
struct SceneDestroyer {
  void operator()(palpate_scene* scene) const { palpate_scene_destroy(scene); }
};
using BundlePointer = std::unique_ptr<palpate_bundle, BundleCloser>;
using ScenePointer = std::unique_ptr<palpate_scene, SceneDestroyer>;

// A copy of bytes, aligned to 64. The allocation has exactly their size, so that a sanitizer reports a read behind the end.
class AlignedBytes {
 public:
  explicit AlignedBytes(const std::string& bytes) : count_(bytes.size()) {
    data_ = static_cast<unsigned char*>(::operator new(count_ > 0 ? count_ : 1, std::align_val_t(64)));
    std::memcpy(data_, bytes.data(), count_);
  }
  ~AlignedBytes() { ::operator delete(data_, std::align_val_t(64)); }
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;
  unsigned char* data() { return data_; }
  std::size_t size() const { return count_; }

 private:
  unsigned char* data_;
  std::size_t count_;
};

}  // namespace palpate::tests
