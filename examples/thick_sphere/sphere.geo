// An eighth of a hollow sphere, radii 1 and 2 m.
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 2, 0, Pi / 2, Pi / 2};
Sphere(2) = {0, 0, 0, 1, 0, Pi / 2, Pi / 2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Mesh.MeshSizeMax = 0.2;
e = 1e-3;
Physical Volume("sphere") = {3};
Physical Surface("x0") = Surface In BoundingBox {-e, -e, -e, e, 2 + e, 2 + e};
Physical Surface("y0") = Surface In BoundingBox {-e, -e, -e, 2 + e, e, 2 + e};
Physical Surface("z0") = Surface In BoundingBox {-e, -e, -e, 2 + e, 2 + e, e};
Physical Surface("inside") = Surface In BoundingBox {-e, -e, -e, 1 + e, 1 + e, 1 + e};
