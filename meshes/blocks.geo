// Two rectangles of the same width on each other: the simplest bodies, for exact solutions.
//
// Lengths in mm; x from their middle, z up from the contact. Structured quadrilaterals.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.

DefineConstant[
  width = 1,
  punch_height = 1,
  strip_height = 1,
  core = 0,            // width of the evenly divided middle; 0: all of it
  across = 2,          // elements over the core; even, so that a node lies at x = 0
  strip_across = 0,    // of the strip where it has others than the punch; 0: the same
  outer = 1,           // elements on each side of the core
  spread = 1,          // of such an element's width over that of its neighbour towards the core
  punch_layers = 2,    // elements over the height
  strip_layers = 2,
  growth = 1           // of an element's height over that of its neighbour towards the contact
];

If(width <= 0 || punch_height <= 0 || strip_height <= 0 || core < 0 || core > width)
  Error("width, punch_height and strip_height must be positive, core between 0 and width");
EndIf
If(across < 2 || across % 2 != 0 || strip_across < 0 || strip_across % 2 != 0)
  Error("across and strip_across must be even");
EndIf
If(punch_layers < 1 || strip_layers < 1 || outer < 1)
  Error("punch_layers, strip_layers and outer must be at least 1");
EndIf
If(growth <= 0 || spread <= 0)
  Error("growth and spread must be positive");
EndIf

heights[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
counts[] = {across, (strip_across > 0) ? strip_across : across};
abscissae[] = {0, (core > 0) ? core / 2 : width / 2};
If(core > 0 && core < width)
  abscissae[] += {width / 2};
EndIf
last = #abscissae[] - 1;
For body In {0 : 1}
  a = newp; Point(a) = {0, 0, 0};
  b = newp; Point(b) = {0, heights[body], 0};
  middle = newl; Line(middle) = {a, b};
  uprights[] = {middle}; contact~{body}[] = {}; ends~{body}[] = {}; sides~{body}[] = {}; parts~{body}[] = {};
  For side In {-1 : 1 : 2}    // both halves from the middle outwards: mirror images to the last digit
    near = a; far = b; upright = middle;
    For i In {1 : last}
      p = newp; Point(p) = {side * abscissae[i], 0, 0};
      q = newp; Point(q) = {side * abscissae[i], heights[body], 0};
      l = newl; Line(l) = {near, p};
      m = newl; Line(m) = {far, q};
      u = newl; Line(u) = {p, q};
      If(i == 1)
        Transfinite Curve{l, m} = counts[body] / 2 + 1;
      Else
        Transfinite Curve{l, m} = outer + 1 Using Progression spread;
      EndIf
      c = newll; Curve Loop(c) = {l, u, -m, -upright};
      s = news; Plane Surface(s) = {c};
      contact~{body}[] += l; ends~{body}[] += m; uprights[] += u; parts~{body}[] += s;
      near = p; far = q; upright = u;
    EndFor
    sides~{body}[] += upright;
  EndFor
  Transfinite Curve{uprights[]} = layers[body] + 1 Using Progression growth;
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
