// One step of a recorded path; the file of a path is an array of them.
#pragma once

namespace palpate::tests {

struct RecordedStep {
  double press[3][3];  // m, the three points of a tool that comes down on the far face
  double pinch[2][3];  // m, the two points of a tool on the top face that close on one another
  double pull[3];      // m, the displacement of a gripped node
};

}  // namespace palpate::tests
