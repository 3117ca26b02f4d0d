// Two rectangles of the same width on each other, touching at z = 0.
DefineConstant[width = 1, punch_height = 1, strip_height = 1, across = 2, punch_layers = 2, strip_layers = 2, growth = 1];
z[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
For body In {0 : 1}
  a = newp; Point(a) = {-width / 2, 0, 0};
  b = newp; Point(b) = {width / 2, 0, 0};
  c = newp; Point(c) = {width / 2, z[body], 0};
  d = newp; Point(d) = {-width / 2, z[body], 0};
  contact = newl; Line(contact) = {a, b};
  right = newl; Line(right) = {b, c};
  far = newl; Line(far) = {d, c};
  left = newl; Line(left) = {a, d};
  Transfinite Curve{contact, far} = across + 1;
  Transfinite Curve{right, left} = layers[body] + 1 Using Progression growth;
  loop = newll; Curve Loop(loop) = {contact, right, -far, -left};
  s = news; Plane Surface(s) = {loop};
  parts~{body}[] = {s, contact, far, left, right};
EndFor
Transfinite Surface{:};
Recombine Surface{:};
Physical Surface("punch_body") = {parts_0[0]};
Physical Curve("punch_contact") = {parts_0[1]};
Physical Curve("punch_far") = {parts_0[2]};
Physical Curve("punch_sides") = {parts_0[3], parts_0[4]};
Physical Surface("strip_body") = {parts_1[0]};
Physical Curve("strip_contact") = {parts_1[1]};
Physical Curve("strip_far") = {parts_1[2]};
Physical Curve("strip_sides") = {parts_1[3], parts_1[4]};
