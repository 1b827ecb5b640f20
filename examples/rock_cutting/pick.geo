// The pick: its tip at the depth of the cut, 0.2 mm left of the block. Millimetres.
D = 5; rake = 10*Pi/180; clearance = 10*Pi/180;
Point(1) = {-0.2, -D, 0, 1};
Point(2) = {-0.2 - 15*Tan(rake), 15 - D, 0, 1};
Point(3) = {-10.2, -D + 10*Tan(clearance), 0, 1};
Line(1) = {2, 1}; Line(2) = {1, 3};
Physical Curve("pick") = {1, 2};
