// A bar of elements that may turn into particles; "core" is particles from the start. Millimetres.
L = 150; H = 12; A = 105; B = 111; h = 3;   // length, height, core, elements
X[] = {0, A, B, L}; n = 3;
For i In {0:n}
  Point(1 + i) = {X[i], 0, 0, h}; Point(11 + i) = {X[i], H, 0, h};
  Line(21 + i) = {1 + i, 11 + i};
  Transfinite Curve {21 + i} = Round(H/h) + 1;
EndFor
For i In {0:n - 1}
  Line(31 + i) = {1 + i, 2 + i}; Line(41 + i) = {11 + i, 12 + i};
  Transfinite Curve {31 + i, 41 + i} = Round((X[i + 1] - X[i])/h) + 1;
  Curve Loop(51 + i) = {31 + i, 22 + i, -(41 + i), -(21 + i)}; Plane Surface(51 + i) = {51 + i};
  Transfinite Surface {51 + i};
EndFor
Physical Surface("bar") = {51:50 + n};
Physical Surface("core") = {52};
Physical Curve("left") = {21};
Physical Curve("right") = {21 + n};
