// Half of a plate that is pressed on a rigid ground and pushed inwards from its sides: the benchmark of a block with friction.
//
// Lengths in mm; x from the plate's free side, z up from the ground. Structured quadrilaterals.

DefineConstant[
  side = 40,
  depth = 5,    // of the ground
  across = 32   // elements along the plate's side
];

heights[] = {side, -depth};
layers[] = {across, 2};
For body In {0 : 1}
  a = newp; Point(a) = {0, 0, 0}; b = newp; Point(b) = {side, 0, 0};
  c = newp; Point(c) = {side, heights[body], 0}; d = newp; Point(d) = {0, heights[body], 0};
  contact~{body} = newl; Line(contact~{body}) = {a, b}; right~{body} = newl; Line(right~{body}) = {b, c};
  far~{body} = newl; Line(far~{body}) = {c, d}; left~{body} = newl; Line(left~{body}) = {d, a};
  loop = newll; Curve Loop(loop) = {contact~{body}, right~{body}, far~{body}, left~{body}};
  part~{body} = news; Plane Surface(part~{body}) = {loop};
  Transfinite Curve{contact~{body}, far~{body}} = across + 1;
  Transfinite Curve{right~{body}, left~{body}} = layers[body] + 1;
EndFor
Transfinite Surface{:};
Recombine Surface{:};

Physical Surface("punch_body") = {part_0};
Physical Curve("punch_contact") = {contact_0};
Physical Curve("punch_middle") = {right_0};
Physical Curve("punch_top") = {far_0};
Physical Curve("punch_side") = {left_0};
Physical Surface("strip_body") = {part_1};
Physical Curve("strip_contact") = {contact_1};
Physical Curve("strip_bottom") = {far_1};
