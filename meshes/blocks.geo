// Two rectangles of the same width on each other: the simplest bodies, for exact solutions.
//
// Lengths in mm; x from their middle, z up from the contact. Structured quadrilaterals.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.

DefineConstant[
  width = 1,
  punch_height = 1,
  strip_height = 1,
  across = 2,          // elements along the contact; even, so that a node lies at x = 0
  strip_across = 0,    // of the strip where it has others than the punch; 0: the same
  punch_layers = 2,    // elements over the height
  strip_layers = 2,
  growth = 1,          // of an element's height over that of its neighbour towards the contact
  spread = 1           // of an element's width over that of its neighbour towards the middle
];

If(width <= 0 || punch_height <= 0 || strip_height <= 0)
  Error("width, punch_height and strip_height must be positive");
EndIf
If(across < 2 || across % 2 != 0 || strip_across < 0 || strip_across % 2 != 0 || punch_layers < 1 || strip_layers < 1)
  Error("across and strip_across must be even, punch_layers and strip_layers at least 1");
EndIf
If(growth <= 0 || spread <= 0)
  Error("growth and spread must be positive");
EndIf

heights[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
counts[] = {across, (strip_across > 0) ? strip_across : across};
For body In {0 : 1}
  near[] = {}; far[] = {}; sides[] = {}; contact[] = {}; ends[] = {}; parts~{body}[] = {};
  For i In {-1 : 1}
    p = newp; Point(p) = {i * width / 2, 0, 0}; near[] += p;
    p = newp; Point(p) = {i * width / 2, heights[body], 0}; far[] += p;
    l = newl; Line(l) = {near[i + 1], far[i + 1]}; sides[] += l;
    Transfinite Curve{l} = layers[body] + 1 Using Progression growth;
  EndFor
  For i In {0 : 2 : 2}    // left and right half, both from the middle outwards: mirror images to the last digit
    l = newl; Line(l) = {near[1], near[i]}; contact[] += l;
    m = newl; Line(m) = {far[1], far[i]}; ends[] += m;
    Transfinite Curve{l, m} = counts[body] / 2 + 1 Using Progression spread;
    c = newll; Curve Loop(c) = {l, sides[i], -m, -sides[1]};
    s = news; Plane Surface(s) = {c}; parts~{body}[] += s;
  EndFor
  contact~{body}[] = contact[];
  ends~{body}[] = ends[];
  sides~{body}[] = {sides[0], sides[2]};
EndFor

Transfinite Surface{:};
Recombine Surface{:};

Physical Surface("punch_body") = parts_0[];
Physical Curve("punch_contact") = contact_0[];
Physical Curve("punch_far") = ends_0[];
Physical Curve("punch_sides") = sides_0[];
Physical Surface("strip_body") = parts_1[];
Physical Curve("strip_contact") = contact_1[];
Physical Curve("strip_far") = ends_1[];
Physical Curve("strip_sides") = sides_1[];
