// Cantilever 200 x 20 x 20 mm (lengths in mm): clamped at x = 0, loaded at x = 200.
SetFactory("Built-in");
L = 200; H = 20; N = 80; M = 8;
Point(1) = {0, 0, 0}; Point(2) = {0, H, 0};
Line(1) = {1, 2};
Transfinite Curve {1} = M + 1;
face[] = Extrude {0, 0, H} { Line{1}; Layers{M}; Recombine; };
beam[] = Extrude {L, 0, 0} { Surface{face[1]}; Layers{N}; Recombine; };
Physical Volume("beam") = {beam[1]};
Physical Surface("clamp") = {face[1]};
Physical Surface("tip") = {beam[0]};
