// A block W x B x H of rock, its upper face z = H. Particles: "near", P long and Z deep from there. Millimetres.
W = 48; B = 24; H = 36; P = 24; Z = 12; h = 6;
X[] = {0, P, W}; Y[] = {H, H - Z, 0};
For i In {0:2}
  For j In {0:2}
    Point(10*i + j + 1) = {X[j], 0, Y[i], h};
  EndFor
EndFor
For i In {0:2}
  For j In {0:1}
    Line(100 + 10*i + j) = {10*i + j + 1, 10*i + j + 2};
    Transfinite Curve {100 + 10*i + j} = Round((X[j + 1] - X[j])/h) + 1;
    Line(200 + 10*i + j) = {10*j + i + 1, 10*j + i + 11};
    Transfinite Curve {200 + 10*i + j} = Round((Y[j] - Y[j + 1])/h) + 1;
  EndFor
EndFor
For i In {0:1}
  For j In {0:1}
    s = 300 + 10*i + j;
    Curve Loop(s) = {200 + 10*j + i, 100 + 10*(i + 1) + j, -(200 + 10*(j + 1) + i), -(100 + 10*i + j)};
    Plane Surface(s) = {s};
    Transfinite Surface {s}; Recombine Surface {s};
    e() = Extrude {0, B, 0} { Surface{s}; Layers{Round(B/h)}; Recombine; };
    v(2*i + j) = e(1);
    f(2*i + j) = e(3); // the side from curve 100 + 10 (i + 1) + j: below
    g(2*i + j) = e(4); // from 200 + 10 (j + 1) + i: at the far end
  EndFor
EndFor
Physical Volume("rock") = {v()};
Physical Volume("near") = {v(0)};
Physical Surface("bottom") = {f(2), f(3)};
Physical Surface("far end") = {g(1), g(3)};
