// A quarter of two rings on each other, in space, between the planes x = 0 and y = 0: rings.geo turned by 90 degrees.

SetFactory("OpenCASCADE");

DefineConstant[
  inner_radius = 20,
  outer_radius = 30,
  punch_height = 10,
  strip_height = 10,
  margin_inside = 0,      // by which the strip is wider on each side
  margin_outside = 0,
  across = 4,             // elements over the contact
  around = 6,             // elements over the quarter
  margin_elements = 2,
  layers = 4
];

heights[] = {punch_height, -strip_height};
eps = 1e-4 * outer_radius;
taken[] = {};
For body In {0 : 1}
  r[] = {}; n[] = {};
  If(body == 1 && margin_inside > 0)
    r[] += {inner_radius - margin_inside}; n[] += margin_elements;
  EndIf
  r[] += {inner_radius, outer_radius}; n[] += across;
  If(body == 1 && margin_outside > 0)
    r[] += {outer_radius + margin_outside}; n[] += margin_elements;
  EndIf
  p[] = {}; q[] = {}; u[] = {}; parts[] = {};
  For i In {0 : #r[] - 1}
    a = newp; Point(a) = {r[i], 0, 0}; p[] += a;
    b = newp; Point(b) = {r[i], 0, heights[body]}; q[] += b;
    c = newl; Line(c) = {a, b}; u[] += c;
    Transfinite Curve{c} = layers + 1;
  EndFor
  For i In {0 : #r[] - 2}
    l = newl; Line(l) = {p[i], p[i + 1]};
    m = newl; Line(m) = {q[i], q[i + 1]};
    Transfinite Curve{l, m} = n[i] + 1;
    o = newll; Curve Loop(o) = {l, u[i + 1], -m, -u[i]};
    s = news; Plane Surface(s) = {o};
    Transfinite Surface{s};
    Recombine Surface{s};
    parts[] += s;
  EndFor
  Extrude{{0, 0, 1}, {0, 0, 0}, Pi / 2}{ Surface{parts[]}; Layers{around}; Recombine; }
  R = 2 * outer_radius; h = heights[body]; low = (h < 0) ? h : 0; high = (h < 0) ? 0 : h;
  volumes~{body}[] = Volume In BoundingBox{-eps, -eps, low - eps, R, R, high + eps};
  far~{body}[] = Surface In BoundingBox{-eps, -eps, h - eps, R, R, h + eps};
  touching~{body}[] = Surface In BoundingBox{-eps, -eps, -eps, outer_radius + eps, outer_radius + eps, eps};
  inner~{body}[] = Surface In BoundingBox{-eps, -eps, -eps, inner_radius + eps, inner_radius + eps, eps};
  touching~{body}[] -= inner~{body}[];
  touching~{body}[] -= taken[];
  taken[] = touching~{body}[];
  on_x~{body}[] = Surface In BoundingBox{-eps, -eps, low - eps, R, eps, high + eps};
  on_y~{body}[] = Surface In BoundingBox{-eps, -eps, low - eps, eps, R, high + eps};
EndFor

Physical Volume("punch_body") = volumes_0[];
Physical Volume("strip_body") = volumes_1[];
Physical Surface("punch_contact") = touching_0[];
Physical Surface("strip_contact") = touching_1[];
Physical Surface("punch_far") = far_0[];
Physical Surface("strip_far") = far_1[];
Physical Surface("punch_plane_x") = on_x_0[];
Physical Surface("strip_plane_x") = on_x_1[];
Physical Surface("punch_plane_y") = on_y_0[];
Physical Surface("strip_plane_y") = on_y_1[];
