// A plate W x T, struck on a part S of its lower face. "upper", its half away from there, is particles. Millimetres.
W = 120; T = 20; S = 70; A = 57; B = 63; h = 2.5;
X[] = {0, (W - S)/2, A, B, (W + S)/2, W}; Y[] = {0, 10, 15, T};
For i In {0:5}
  For j In {0:3}
    Point(10*i + j + 1) = {X[i], Y[j], 0, h};
  EndFor
EndFor
For i In {0:5}
  For j In {0:2}
    Line(100 + 10*i + j) = {10*i + j + 1, 10*i + j + 2};
    Transfinite Curve {100 + 10*i + j} = Round((Y[j + 1] - Y[j])/h) + 1;
  EndFor
EndFor
For i In {0:4}
  For j In {0:3}
    Line(200 + 10*i + j) = {10*i + j + 1, 10*i + j + 11};
    Transfinite Curve {200 + 10*i + j} = Round((X[i + 1] - X[i])/h) + 1;
  EndFor
EndFor
For i In {0:4}
  For j In {0:2}
    Curve Loop(300 + 10*i + j) = {200 + 10*i + j, 100 + 10*(i + 1) + j, -(200 + 10*i + j + 1), -(100 + 10*i + j)};
    Plane Surface(300 + 10*i + j) = {300 + 10*i + j};
    Transfinite Surface {300 + 10*i + j};
  EndFor
EndFor
Physical Surface("plate") = {300:302, 310:312, 320:322, 330:332, 340:342};
Physical Surface("upper") = {301:302, 311:312, 321:322, 331:332, 341:342};
Physical Surface("spot") = {321}; // where particles begin when elements turn
Physical Curve("struck") = {210, 220, 230};
Physical Curve("back") = {203, 213, 223, 233, 243};
