// A block of rock cut from its left edge, plane strain. Millimetres; the uncut surface is y = 0, the cut D deep.
// Particles: "near", "near 2" or "near 4", that reach 1, 2 or 4 cut depths below the cut, or all of the block.
D = 5; W = 100; H = 60; P = 45; h = 5;    // cut depth, block, length of the particles' part, elements
Y[] = {0, -2*D, -3*D, -5*D, -H};
For i In {0:4}
  Point(10 + i) = {0, Y[i], 0, h}; Point(20 + i) = {P, Y[i], 0, h}; Point(30 + i) = {W, Y[i], 0, h};
  Line(100 + i) = {10 + i, 20 + i}; Line(110 + i) = {20 + i, 30 + i};
EndFor
For i In {0:3}
  Line(120 + i) = {10 + i, 11 + i}; Line(130 + i) = {20 + i, 21 + i}; Line(140 + i) = {30 + i, 31 + i};
  Curve Loop(200 + i) = {120 + i, 101 + i, -(130 + i), -(100 + i)}; Plane Surface(200 + i) = {200 + i};
  Curve Loop(210 + i) = {130 + i, 111 + i, -(140 + i), -(110 + i)}; Plane Surface(210 + i) = {210 + i};
  n = (Y[i] - Y[i + 1]) / h + 1;
  Transfinite Curve {120 + i, 130 + i, 140 + i} = n;
EndFor
Transfinite Curve {100:104} = P/h + 1;
Transfinite Curve {110:114} = (W - P)/h + 1;
Transfinite Surface {200:203, 210:213};
Physical Surface("rock") = {200:203, 210:213};
Physical Surface("near") = {200};
Physical Surface("near 2") = {200, 201};
Physical Surface("near 4") = {200, 201, 202};
Physical Curve("bottom") = {104, 114};
Physical Curve("right side") = {140:143};
