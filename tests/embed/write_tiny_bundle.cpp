// Writes the box bundle of tests/support to the file it is given.
#include "tests/support/tiny_bundle.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  palpate::tests::write_bundle(argv[1], palpate::tests::tiny_bundle());
}
