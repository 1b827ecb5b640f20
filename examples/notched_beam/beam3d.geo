// The half-notched beam of beam.geo as a solid, 50 mm thick. Millimetres. Coarser: meant for particles of 1.5 to 2 mm.
SetFactory("Built-in");
L = 175; H = 50; S = 125; a = 25; w = 4; T = 50; // length, depth, span, notch depth, notch width, thickness
b = 24; below = 8;                        // half width of the strip; how far it reaches below the notch tip
p = 1.5;                                  // half width of the load's bearing
h = 8; f = 12;                            // elements beside the strip; far away
c = L/2;

Point(1) = {0, 0, 0, f};
Point(2) = {c - S/2, 0, 0, f};
Point(4) = {c - w/2, 0, 0, h};
Point(5) = {c - w/2, a - below, 0, h};
Point(6) = {c - w/2, a, 0, h};
Point(7) = {c + w/2, a, 0, h};
Point(8) = {c + w/2, a - below, 0, h};
Point(9) = {c + w/2, 0, 0, h};
Point(10) = {c + S/2, 0, 0, f};
Point(12) = {L, 0, 0, f};
Point(13) = {L, H, 0, f};
Point(14) = {c + b, H, 0, h};
Point(15) = {c + p, H, 0, h};
Point(16) = {c - p, H, 0, h};
Point(17) = {c - b, H, 0, h};
Point(18) = {0, H, 0, f};
Point(19) = {c - b, a - below, 0, h};
Point(20) = {c + b, a - below, 0, h};

Line(1) = {1, 2};    Line(3) = {2, 4};    Line(4) = {4, 5};
Line(5) = {5, 6};    Line(6) = {6, 7};    Line(7) = {7, 8};   Line(8) = {8, 9};
Line(9) = {9, 10};   Line(11) = {10, 12}; Line(12) = {12, 13};
Line(13) = {13, 14}; Line(14) = {14, 15}; Line(15) = {15, 16}; Line(16) = {16, 17};
Line(17) = {17, 18}; Line(18) = {18, 1};
Line(19) = {17, 19}; Line(20) = {19, 5};  Line(21) = {8, 20};  Line(22) = {20, 14};

Curve Loop(1) = {1, 3, 4, -20, -19, 17, 18};       Plane Surface(1) = {1};
Curve Loop(2) = {8, 9, 11, 12, 13, -22, -21};     Plane Surface(2) = {2};
Curve Loop(3) = {5, 6, 7, 21, 22, 14, 15, 16, 19, 20}; Plane Surface(3) = {3};

left[] = Extrude {0, 0, T} { Surface{1}; };       // left[2 ..]: sides in the order of the loop
right[] = Extrude {0, 0, T} { Surface{2}; };
middle[] = Extrude {0, 0, T} { Surface{3}; };

Physical Volume("arms") = {left[1], right[1]};
Physical Volume("ligament") = {middle[1]};
Physical Surface("load") = {middle[8]};           // of line 15
e = 1e-3;
left_edge[] = Curve In BoundingBox {c - S/2 - e, -e, -e, c - S/2 + e, e, T + e};
right_edge[] = Curve In BoundingBox {c + S/2 - e, -e, -e, c + S/2 + e, e, T + e};
lips[] = Curve In BoundingBox {c - w/2 - e, -e, -e, c - w/2 + e, e, T + e};
lips[] += Curve In BoundingBox {c + w/2 - e, -e, -e, c + w/2 + e, e, T + e};
Physical Curve("left support") = {left_edge[]};
Physical Curve("right support") = {right_edge[]};
Physical Curve("notch mouth") = {lips[]};
