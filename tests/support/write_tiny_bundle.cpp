// write_tiny_bundle FILE [interior] [single_dof]: a small real bundle for tests that run programs.
#include <cstring>

#include "tests/support/tiny_bundle.h"

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  palpate::tests::TinyBox box{.interior = false};
  for (int i = 2; i < argc; ++i) {
    box.interior = box.interior || std::strcmp(argv[i], "interior") == 0;
    box.single_dof = box.single_dof || std::strcmp(argv[i], "single_dof") == 0;
  }
  palpate::tests::write_bundle(argv[1], palpate::tests::tiny_bundle(box));
  return 0;
}
