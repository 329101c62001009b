// A block of 63 x 30 x 50 mm with a slot from the top down to z = 15 mm: two walls on a base. Millimetres.
DefineConstant[ edge = 7 ];
length = 63;
width = 30;
height = 50;
slot_begin = 30;
slot_end = 33;
slot_bottom = 15;

Point(1) = {0, 0, 0, edge};
Point(2) = {length, 0, 0, edge};
Point(3) = {length, 0, height, edge};
Point(4) = {slot_end, 0, height, edge};
Point(5) = {slot_end, 0, slot_bottom, edge};
Point(6) = {slot_begin, 0, slot_bottom, edge};
Point(7) = {slot_begin, 0, height, edge};
Point(8) = {0, 0, height, edge};
For i In {1:8}
  Line(i) = {i, i % 8 + 1};
EndFor
Line Loop(1) = {1:8};
Plane Surface(1) = {1};
body[] = Extrude {0, width, 0} { Surface{1}; };
Physical Volume("body") = {body[1]};
Physical Surface("bottom") = {body[2]};
