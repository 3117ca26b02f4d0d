// A round punch with a rounded edge on a round foundation, half of their section: the second of NAFEMS' contact benchmarks.
//
// Lengths in mm; x is the radius, z up from the foundation's bottom. Triangles, finest where the punch's edge begins.

DefineConstant[
  radius = 50,          // of the punch
  height = 100,
  fillet = 10,
  foundation = 100,     // radius
  depth = 200,
  size = 0.5,           // of elements where the edge begins
  largest = 12
];

flat = radius - fillet;
top = depth + height;
reach = 30 * Pi / 180;   // of the edge that may touch
Point(1) = {0, depth, 0}; Point(2) = {flat, depth, 0}; Point(3) = {flat, depth + fillet, 0};
Point(4) = {flat + fillet * Sin(reach), depth + fillet * (1 - Cos(reach)), 0};
Point(5) = {radius, depth + fillet, 0}; Point(6) = {radius, top, 0}; Point(7) = {0, top, 0};
Line(1) = {1, 2}; Circle(2) = {2, 3, 4}; Circle(3) = {4, 3, 5}; Line(4) = {5, 6}; Line(5) = {6, 7}; Line(6) = {7, 1};
Curve Loop(1) = {1:6}; Plane Surface(1) = {1};

Point(11) = {0, 0, 0}; Point(12) = {foundation, 0, 0}; Point(13) = {foundation, depth, 0};
Point(14) = {radius, depth, 0}; Point(15) = {0, depth, 0};
Line(11) = {11, 12}; Line(12) = {12, 13}; Line(13) = {13, 14}; Line(14) = {14, 15}; Line(15) = {15, 11};
Curve Loop(2) = {11:15}; Plane Surface(2) = {2};

Field[1] = Distance; Field[1].PointsList = {2};
Field[2] = MathEval; Field[2].F = Sprintf("Min(%g + 0.15 * F1, %g)", size, largest);
Background Field = 2;
Mesh.MeshSizeExtendFromBoundary = 0; Mesh.MeshSizeFromPoints = 0; Mesh.MeshSizeFromCurvature = 0;

Physical Surface("punch_body") = {1};
Physical Surface("strip_body") = {2};
Physical Curve("punch_contact") = {1, 2};
Physical Curve("punch_top") = {5};
Physical Curve("strip_contact") = {14};
Physical Curve("strip_bottom") = {11};
