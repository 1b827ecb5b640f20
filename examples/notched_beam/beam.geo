// Half-notched beam of Gregoire et al. 2013, smallest size: 175 x 50 mm, span 125 mm, notch 25 mm deep. Millimetres.
// Particles fill "ligament": a strip about the crack's way, from just below the notch tip to the top.
L = 175; H = 50; S = 125; a = 25; w = 2;   // length, depth, span, notch depth, notch width
b = 10; below = 5;                        // half width of the strip; how far it reaches below the notch tip
p = 0.5;                                  // half width of the bearing under the load: wider ones hold the opening halves like a clamp
h = 3;                                    // elements beside the strip
c = L/2; f = 6;                           // f: elements far away

// bottom, left to right
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
// top, right to left
Point(13) = {L, H, 0, f};
Point(14) = {c + b, H, 0, h};
Point(15) = {c + p, H, 0, h};
Point(16) = {c - p, H, 0, h};
Point(17) = {c - b, H, 0, h};
Point(18) = {0, H, 0, f};
// strip
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

Physical Surface("arms") = {1, 2};
Physical Surface("ligament") = {3};
Physical Point("left support") = {2};
Physical Point("right support") = {10};
Physical Curve("load") = {15};
Physical Point("notch mouth") = {4, 9};
