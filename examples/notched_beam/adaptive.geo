// The half-notched beam for runs that are compared: elements that turn, a fixed overlap, particles alone. Millimetres.
// "seed" is particles from the start: about the notch tip, and under the load. "ligament" may turn, or is particles from the start.
L = 175; H = 50; S = 125; a = 25; w = 2;    // length, depth, span, notch depth, notch width
b = 12; below = 6;                          // half width of the ligament; how far it reaches below the notch tip
s = 3; top = 6;                             // half width of the seeds; depth of the one under the load
p = 1; q = 2; m = 2;                        // half width of the load's bearing, of the supports'; length of the lips at the mouth
h = 3; f = 6; c = L/2;                      // elements in and about the ligament, far away

Point(1) = {0, 0, 0, f};
Point(2) = {c - S/2 - q, 0, 0, h};   Point(3) = {c - S/2 + q, 0, 0, h};
Point(4) = {c - w/2, 0, 0, h};       Point(5) = {c - w/2, m, 0, h};
Point(6) = {c - w/2, a - below, 0, h}; Point(7) = {c - w/2, a - 3, 0, h}; Point(8) = {c - w/2, a, 0, h};
Point(9) = {c + w/2, a, 0, h};       Point(10) = {c + w/2, a - 3, 0, h}; Point(11) = {c + w/2, a - below, 0, h};
Point(12) = {c + w/2, m, 0, h};      Point(13) = {c + w/2, 0, 0, h};
Point(14) = {c + S/2 - q, 0, 0, h};  Point(15) = {c + S/2 + q, 0, 0, h};
Point(16) = {L, 0, 0, f};            Point(17) = {L, H, 0, f};
Point(18) = {c + b, H, 0, h};        Point(19) = {c + s, H, 0, h};
Point(20) = {c + p, H, 0, h};        Point(21) = {c - p, H, 0, h};
Point(22) = {c - s, H, 0, h};        Point(23) = {c - b, H, 0, h};
Point(24) = {0, H, 0, f};
Point(25) = {c - b, a - below, 0, h}; Point(26) = {c + b, a - below, 0, h}; // ligament
Point(27) = {c - s, a - 3, 0, h};    Point(28) = {c - s, a + s, 0, h};      // seed at the tip
Point(29) = {c + s, a + s, 0, h};    Point(30) = {c + s, a - 3, 0, h};
Point(31) = {c - s, H - top, 0, h};  Point(32) = {c + s, H - top, 0, h};    // seed under the load

Line(1) = {1, 2};    Line(2) = {2, 3};    Line(3) = {3, 4};   Line(4) = {4, 5};   Line(5) = {5, 6};   Line(6) = {6, 7};
Line(7) = {7, 8};    Line(8) = {8, 9};    Line(9) = {9, 10};  Line(10) = {10, 11}; Line(11) = {11, 12}; Line(12) = {12, 13};
Line(13) = {13, 14}; Line(14) = {14, 15}; Line(15) = {15, 16}; Line(16) = {16, 17}; Line(17) = {17, 18}; Line(18) = {18, 19};
Line(19) = {19, 20}; Line(20) = {20, 21}; Line(21) = {21, 22}; Line(22) = {22, 23}; Line(23) = {23, 24}; Line(24) = {24, 1};
Line(25) = {23, 25}; Line(26) = {25, 6};  Line(27) = {11, 26}; Line(28) = {26, 18};
Line(29) = {7, 27};  Line(30) = {27, 28}; Line(31) = {28, 29}; Line(32) = {29, 30}; Line(33) = {30, 10};
Line(34) = {22, 31}; Line(35) = {31, 32}; Line(36) = {32, 19};

Curve Loop(1) = {1, 2, 3, 4, 5, -26, -25, 23, 24};                                Plane Surface(1) = {1};
Curve Loop(2) = {12, 13, 14, 15, 16, 17, -28, -27, 11};                           Plane Surface(2) = {2};
Curve Loop(3) = {7, 8, 9, -33, -32, -31, -30, -29};                               Plane Surface(3) = {3};
Curve Loop(4) = {19, 20, 21, 34, 35, 36};                                         Plane Surface(4) = {4};
Curve Loop(5) = {6, 29, 30, 31, 32, 33, 10, 27, 28, 18, -36, -35, -34, 22, 25, 26}; Plane Surface(5) = {5};

Physical Surface("arms") = {1, 2};
Physical Surface("ligament") = {3, 4, 5};
Physical Surface("seed") = {3, 4};
Physical Curve("left support") = {2};
Physical Curve("right support") = {14};
Physical Curve("load") = {20};
Physical Curve("left lip") = {4};
Physical Curve("right lip") = {12};
