// A block of rock cut from its left edge, plane strain. Millimetres; the uncut surface is y = 0, the cut D deep.
// Particles from the start: "seed", two cuts deep about the edge the pick meets; the rest may turn.
D = 5; W = 100; H = 60; S = 12; h = 4;    // cut depth, block, seed, elements
X[] = {0, S, W}; Y[] = {0, -S, -H};
For i In {0:2}
  For j In {0:2}
    Point(10*i + j + 1) = {X[j], Y[i], 0, h};
  EndFor
EndFor
For i In {0:2}
  For j In {0:1}
    Line(100 + 10*i + j) = {10*i + j + 1, 10*i + j + 2};
    Transfinite Curve {100 + 10*i + j} = (X[j + 1] - X[j])/h + 1;
    Line(200 + 10*i + j) = {10*j + i + 1, 10*j + i + 11};
    Transfinite Curve {200 + 10*i + j} = (Y[j] - Y[j + 1])/h + 1;
  EndFor
EndFor
For i In {0:1}
  For j In {0:1}
    Curve Loop(300 + 10*i + j) = {200 + 10*j + i, 100 + 10*(i + 1) + j, -(200 + 10*(j + 1) + i), -(100 + 10*i + j)};
    Plane Surface(300 + 10*i + j) = {300 + 10*i + j};
    Transfinite Surface {300 + 10*i + j};
  EndFor
EndFor
Physical Surface("rock") = {300, 301, 310, 311};
Physical Surface("seed") = {300};
Physical Curve("bottom") = {120, 121};
Physical Curve("right side") = {220, 221};
