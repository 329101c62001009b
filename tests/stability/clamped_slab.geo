// A slab of 120 x 30 x 12 mm: clamped at x = 0 it is a lever. Millimetres.
DefineConstant[ edge = 8, layers = 2 ];
length = 120;
width = 30;
thickness = 12;

Point(1) = {0, 0, 0, edge};
Point(2) = {length, 0, 0, edge};
Point(3) = {length, width, 0, edge};
Point(4) = {0, width, 0, edge};
For i In {1:4}
  Line(i) = {i, i % 4 + 1};
EndFor
Line Loop(1) = {1:4};
Plane Surface(1) = {1};
body[] = Extrude {0, 0, thickness} { Surface{1}; Layers{layers}; };
Physical Volume("body") = {body[1]};
Physical Surface("clamp") = {body[5]};
