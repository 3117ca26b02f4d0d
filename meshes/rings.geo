// Two rings on each other, as their cross-section: x is the radius, z up from the contact. Structured quadrilaterals.
//
// Lengths in mm. An inner radius of 0 makes a disc. The strip may be wider than the punch on each side; its
// contact surface is the part below the punch, which alone wears.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.

DefineConstant[
  inner_radius = 20,      // of the punch
  outer_radius = 30,
  punch_height = 10,
  strip_height = 10,
  margin_inside = 0,      // by which the strip is wider on each side; inside at most the inner radius
  margin_outside = 0,
  across = 8,             // elements over the contact
  strip_across = 0,       // of the strip where it has others than the punch; 0: the same
  edge_grading = 1,       // of an element's width in the middle of the contact over that at its edges
  margin_elements = 2,    // over each margin
  spread = 1,             // of such an element's width over that of its neighbour towards the contact
  punch_layers = 4,       // elements over the height
  strip_layers = 4,
  growth = 1              // of an element's height over that of its neighbour towards the contact
];

If(inner_radius < 0 || outer_radius <= inner_radius || punch_height <= 0 || strip_height <= 0)
  Error("expected 0 <= inner_radius < outer_radius, and positive heights");
EndIf
If(margin_inside < 0 || margin_inside > inner_radius || margin_outside < 0)
  Error("margin_inside must lie between 0 and inner_radius, margin_outside not below 0");
EndIf
If(across < 1 || margin_elements < 1 || punch_layers < 1 || strip_layers < 1)
  Error("across, margin_elements, punch_layers and strip_layers must be at least 1");
EndIf
If(growth <= 0 || edge_grading <= 0 || spread <= 0)
  Error("growth, edge_grading and spread must be positive");
EndIf

heights[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
counts[] = {across, (strip_across > 0) ? strip_across : across};
For body In {0 : 1}
  r[] = {}; n[] = {}; side[] = {};
  If(body == 1 && margin_inside > 0)
    r[] += {inner_radius - margin_inside}; n[] += margin_elements; side[] += -1;
  EndIf
  r[] += {inner_radius, outer_radius}; n[] += counts[body]; side[] += 0;
  If(body == 1 && margin_outside > 0)
    r[] += {outer_radius + margin_outside}; n[] += margin_elements; side[] += 1;
  EndIf
  contact~{body}[] = {}; free~{body}[] = {}; ends~{body}[] = {}; uprights~{body}[] = {}; parts~{body}[] = {};
  p[] = {}; q[] = {};
  For i In {0 : #r[] - 1}
    a = newp; Point(a) = {r[i], 0, 0};
    b = newp; Point(b) = {r[i], heights[body], 0};
    u = newl; Line(u) = {a, b};
    Transfinite Curve{u} = layers[body] + 1 Using Progression growth;
    p[] += a; q[] += b; uprights~{body}[] += u;
  EndFor
  For i In {0 : #r[] - 2}
    l = newl; Line(l) = {p[i], p[i + 1]};
    m = newl; Line(m) = {q[i], q[i + 1]};
    If(side[i] != 0)
      Transfinite Curve{l, m} = n[i] + 1 Using Progression spread^side[i];
    ElseIf(edge_grading != 1)
      Transfinite Curve{l, m} = n[i] + 1 Using Bump 1 / edge_grading;
    Else
      Transfinite Curve{l, m} = n[i] + 1;
    EndIf
    c = newll; Curve Loop(c) = {l, uprights~{body}[i + 1], -m, -uprights~{body}[i]};
    s = news; Plane Surface(s) = {c};
    If(side[i] == 0)
      contact~{body}[] += l;
    Else
      free~{body}[] += l;
    EndIf
    ends~{body}[] += m; parts~{body}[] += s;
  EndFor
EndFor

Transfinite Surface{:};
Recombine Surface{:};

Physical Surface("punch_body") = parts_0[];
Physical Curve("punch_contact") = contact_0[];
Physical Curve("punch_far") = ends_0[];
Physical Curve("punch_inside") = uprights_0[0];
Physical Curve("punch_outside") = uprights_0[#uprights_0[] - 1];
Physical Surface("strip_body") = parts_1[];
Physical Curve("strip_contact") = contact_1[];
If(#free_1[] > 0)
  Physical Curve("strip_free") = free_1[];
EndIf
Physical Curve("strip_far") = ends_1[];
Physical Curve("strip_inside") = uprights_1[0];
Physical Curve("strip_outside") = uprights_1[#uprights_1[] - 1];
