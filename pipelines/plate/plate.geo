// A square plate, 100 x 100 x 10 millimetres, as in figure 5 of Cotin, Delingette and Ayache 1999.
DefineConstant[ edge = 5, layers = 3 ];
length = 100;
thickness = 10;

Point(1) = {0, 0, 0, edge};
Point(2) = {length, 0, 0, edge};
Point(3) = {length, length, 0, edge};
Point(4) = {0, length, 0, edge};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Line Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
body[] = Extrude {0, 0, thickness} { Surface{1}; Layers{layers}; };

Physical Volume("plate") = {body[1]};
Physical Surface("bottom") = {1};
Physical Surface("top") = {body[0]};
Physical Surface("side") = {body[2], body[3], body[4], body[5]};
