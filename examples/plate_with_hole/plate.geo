// A quarter of a plate 300 x 100 mm with a hole of 20 mm in its middle (lengths in mm), pulled along x.
SetFactory("Built-in");
R = 10; W = 50; L = 150;
Point(1) = {0, 0, 0, 2}; Point(2) = {R, 0, 0, 0.8}; Point(3) = {L, 0, 0, 12}; Point(4) = {L, W, 0, 12}; Point(5) = {0, W, 0, 5}; Point(6) = {0, R, 0, 0.8};
Line(1) = {2, 3}; Line(2) = {3, 4}; Line(3) = {4, 5}; Line(4) = {5, 6};
Circle(5) = {6, 1, 2};
Curve Loop(1) = {1, 2, 3, 4, 5};
Plane Surface(1) = {1};
Physical Surface("plate") = {1};
Physical Curve("axis") = {1};
Physical Curve("end") = {2};
Physical Curve("ligament") = {4};
Physical Curve("hole") = {5};
