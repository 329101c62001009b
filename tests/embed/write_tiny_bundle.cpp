// write_tiny_bundle FILE [long]: writes the box bundle of tests/support; long: a box so long that blocks have low rank.
#include "tests/support/tiny_bundle.h"

int main(int argc, char** argv) {
  using namespace palpate::tests;
  if (argc != 2 && argc != 3) return 2;
  const TinyBox box = argc == 3 ? TinyBox{.cells = {14, 3, 3}, .size = {0.28, 0.06, 0.06}} : TinyBox{};
  write_bundle(argv[1], tiny_bundle(box));
}
