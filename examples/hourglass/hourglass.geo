// An hourglass: tube, cone, neck, cone, tube about the z axis. Metres.
SetFactory("OpenCASCADE");
Point(1) = {0.030, 0, 0.120};
Point(2) = {0.030, 0, 0.032};
Point(3) = {0.009, 0, 0.004};
Point(4) = {0.009, 0, -0.004};
Point(5) = {0.030, 0, -0.032};
Point(6) = {0.030, 0, -0.075};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
s() = Extrude {{0, 0, 1}, {0, 0, 0}, 2*Pi} { Line{1, 2, 3, 4, 5}; };
Physical Surface("glass") = Surface{:};
