// The half-notched beam for runs that are compared: elements that turn, a fixed overlap, particles alone. Millimetres.
// "seed" is particles from the start: about the notch tip, and under the load. "ligament" may turn, or is particles from the start.
// Quadrilaterals of three particles to a side wherever an overlap may lie: the ligament and two rows below it, laid in rows but for the two seeds.
L = 175; H = 50; S = 125; a = 25; w = 2;    // length, depth, span, notch depth, notch width
b = 13; s = 4; r = 3.125;                   // half width of the ligament, of the seeds; height of a row
p = 0.5; q = 0.5; m = 2;                      // half width of the load's bearing, of the supports'; length of the lips at the mouth
h = 3; f = 6; c = L/2;                      // elements in and about the ligament, far away

Point(1) = {0, 0, 0, f};                  Point(2) = {c - S/2 - q, 0, 0, h};  Point(3) = {c - S/2 + q, 0, 0, h};
Point(4) = {c - w/2, 0, 0, h};            Point(5) = {c - w/2, m, 0, h};      Point(6) = {c - w/2, a - 2*r, 0, h};
Point(7) = {c - w/2, a - r, 0, h};        Point(8) = {c - w/2, a, 0, h};
Point(9) = {c + w/2, a, 0, h};            Point(10) = {c + w/2, a - r, 0, h}; Point(11) = {c + w/2, a - 2*r, 0, h};
Point(12) = {c + w/2, m, 0, h};           Point(13) = {c + w/2, 0, 0, h};     Point(14) = {c + S/2 - q, 0, 0, h};
Point(15) = {c + S/2 + q, 0, 0, h};       Point(16) = {L, 0, 0, f};           Point(17) = {L, H, 0, f};
Point(18) = {0, H, 0, f};
// the ligament's lines: x = c -+ b, c -+ s; y = a - 2r, a - r, a + r, H - 2r, H
For i In {0:3}
  x = c + (i < 2 ? (i < 1 ? -b : -s) : (i < 3 ? s : b));
  Point(20 + i) = {x, a - 2*r, 0, h}; Point(30 + i) = {x, a - r, 0, h}; Point(40 + i) = {x, a + r, 0, h};
  Point(50 + i) = {x, H - 2*r, 0, h}; Point(60 + i) = {x, H, 0, h};
EndFor
Point(80) = {c - b, a - 4*r, 0, h}; Point(81) = {c - w/2, a - 4*r, 0, h}; Point(82) = {c + w/2, a - 4*r, 0, h}; Point(83) = {c + b, a - 4*r, 0, h};
Point(70) = {c - p, H, 0, h}; Point(71) = {c + p, H, 0, h};

Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 81}; Line(110) = {81, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 9};
Line(9) = {9, 10}; Line(10) = {10, 11}; Line(111) = {11, 82}; Line(11) = {82, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 15}; Line(15) = {15, 16};
Line(16) = {16, 17}; Line(17) = {17, 63}; Line(18) = {60, 18}; Line(19) = {18, 1};
// rows, left to right
Line(20) = {20, 21}; Line(21) = {21, 6};  Line(22) = {11, 22}; Line(23) = {22, 23};
Line(30) = {30, 31}; Line(31) = {31, 7};  Line(32) = {10, 32}; Line(33) = {32, 33};
Line(40) = {40, 41}; Line(41) = {41, 42}; Line(42) = {42, 43};
Line(50) = {50, 51}; Line(51) = {51, 52}; Line(52) = {52, 53};
Line(60) = {60, 61}; Line(61) = {61, 70}; Line(62) = {70, 71}; Line(63) = {71, 62}; Line(64) = {62, 63};
Line(112) = {80, 81}; Line(113) = {82, 83}; Line(114) = {80, 20}; Line(115) = {83, 23};
// columns, upwards
For i In {0:3}
  Line(70 + i) = {20 + i, 30 + i}; Line(80 + i) = {30 + i, 40 + i}; Line(90 + i) = {40 + i, 50 + i}; Line(100 + i) = {50 + i, 60 + i};
EndFor

Curve Loop(1) = {1, 2, 3, 4, 5, -112, 114, 70, 80, 90, 100, 18, 19};               Plane Surface(1) = {1};  // arms
Curve Loop(2) = {11, 12, 13, 14, 15, 16, 17, -103, -93, -83, -73, -115, -113};     Plane Surface(2) = {2};
Curve Loop(16) = {112, 110, -21, -20, -114};  Plane Surface(16) = {16};
Curve Loop(17) = {113, 115, -23, -22, 111};   Plane Surface(17) = {17};
Curve Loop(3) = {20, 71, -30, -70};   Plane Surface(3) = {3};
Curve Loop(4) = {21, 6, -31, -71};    Plane Surface(4) = {4};
Curve Loop(5) = {22, 72, -32, 10};    Plane Surface(5) = {5};
Curve Loop(6) = {23, 73, -33, -72};   Plane Surface(6) = {6};
Curve Loop(7) = {30, 81, -40, -80};   Plane Surface(7) = {7};
Curve Loop(8) = {33, 83, -42, -82};   Plane Surface(8) = {8};
Curve Loop(9) = {40, 91, -50, -90};   Plane Surface(9) = {9};
Curve Loop(10) = {41, 92, -51, -91};  Plane Surface(10) = {10};
Curve Loop(11) = {42, 93, -52, -92};  Plane Surface(11) = {11};
Curve Loop(12) = {50, 101, -60, -100}; Plane Surface(12) = {12};
Curve Loop(13) = {52, 103, -64, -102}; Plane Surface(13) = {13};
Curve Loop(14) = {31, 7, 8, 9, 32, 82, -41, -81}; Plane Surface(14) = {14};           // seed at the tip
Curve Loop(15) = {51, 102, -63, -62, -61, -101};  Plane Surface(15) = {15};           // seed under the load

Transfinite Curve {20, 30, 40, 50, 60, 23, 33, 42, 52, 64} = 4;   // 9 mm in three
Transfinite Curve {21, 31, 22, 32} = 2;
Transfinite Curve {41, 51} = 3;                                  // 8 mm in two
Transfinite Curve {6, 10, 70:73} = 2;
Transfinite Curve {80:83, 100:103} = 3;                          // 6.25 mm in two
Transfinite Curve {90:93} = 6;                                   // 15.625 mm in five
Transfinite Curve {112, 113} = 5; Transfinite Curve {114, 115, 110, 111} = 3;
Transfinite Surface {3:13};
Transfinite Surface {16} = {80, 81, 6, 20}; Transfinite Surface {17} = {82, 83, 23, 11};

Physical Surface("arms") = {1, 2, 16, 17};
Physical Surface("ligament") = {3:15};
Physical Surface("seed") = {14, 15};
Physical Curve("left support") = {2};
Physical Curve("right support") = {14};
Physical Curve("load") = {62};
Physical Curve("left lip") = {4};
Physical Curve("right lip") = {12};
