// A cylinder of brain, 30 mm diameter and 13 mm high, millimetres. Its base is a regular polygon with the area of the
// circle: the force of a compressed prism depends on its section's area alone, so it equals the round cylinder's.
DefineConstant[ sides = 32, edge = 3 ];
radius = 15;
height = 13;
corner = radius * Sqrt(Pi / (sides / 2 * Sin(2 * Pi / sides)));

For i In {0 : sides - 1}
  Point(i + 1) = {corner * Cos(2 * Pi * i / sides), corner * Sin(2 * Pi * i / sides), 0, edge};
EndFor
For i In {1 : sides}
  Line(i) = {i, i % sides + 1};
EndFor
Line Loop(1) = {1 : sides};
Plane Surface(1) = {1};
// A node on the axis: the boundary set holds it sideways, so that the cylinder widens about its axis.
Point(sides + 1) = {0, 0, 0, edge};
Point{sides + 1} In Surface{1};

// Layers of equal height, an even number of them: a ring of nodes lies at mid-height.
layers = 2 * Ceil(height / 2 / edge);
body[] = Extrude {0, 0, height} { Surface{1}; Layers{layers}; };

Physical Volume("brain") = {body[1]};
Physical Surface("bottom") = {1};
Physical Surface("top") = {body[0]};
sides_of_body[] = {};
For i In {2 : sides + 1}
  sides_of_body[] += body[i];
EndFor
Physical Surface("side") = {sides_of_body[]};
