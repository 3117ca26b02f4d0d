// A ring in the groove of a shaft or piston, both sides of which it may touch, as their cross-section: x is the radius, z the
// axis. Structured quadrilaterals.
//
// Lengths in mm. The ring rests on the lower side, z = 0; on the upper one the clearance is left. Physical groups: every name
// starts with the body it belongs to, punch_ (the ring) or strip_ (the body with the groove).

DefineConstant[
  inner_radius = 31,      // of the ring
  outer_radius = 40,
  height = 4,             // of the ring, along the axis
  clearance = 0.05,       // of the groove, wider than the ring by it
  land_radius = 38,       // to which the groove's sides reach; the ring reaches beyond
  groove_radius = 30,     // of the groove's bottom
  shaft_radius = 20,      // to which the shaft or piston is meshed
  land_height = 5,        // of the shaft above and below the groove
  across = 8,             // elements over each side of the ring in the groove
  beyond_elements = 2,    // from there to the ring's outside
  behind_elements = 1,    // between the ring and the groove's bottom
  shaft_elements = 4,     // from there inwards
  ring_layers = 4,        // elements over the height of the ring
  land_layers = 4
];

If(shaft_radius <= 0 || groove_radius <= shaft_radius || inner_radius <= groove_radius || land_radius <= inner_radius || outer_radius <= land_radius)
  Error("expected 0 < shaft_radius < groove_radius < inner_radius < land_radius < outer_radius");
EndIf
If(height <= 0 || land_height <= 0 || clearance < 0)
  Error("height and land_height must be positive, clearance not negative: a ring higher than its groove does not go in");
EndIf
If(across < 1 || beyond_elements < 1 || behind_elements < 1 || shaft_elements < 1 || ring_layers < 1 || land_layers < 1)
  Error("numbers of elements must be at least 1");
EndIf

// Lattices of points (columns r, rows z): the cells that are there are filled.
columns_0[] = {inner_radius, land_radius, outer_radius};
rows_0[] = {0, height};
across_0[] = {across, beyond_elements}; up_0[] = {ring_layers};
columns_1[] = {shaft_radius, groove_radius, inner_radius, land_radius};
rows_1[] = {-land_height, 0, height + clearance, height + clearance + land_height};
across_1[] = {shaft_elements, behind_elements, across}; up_1[] = {land_layers, ring_layers, land_layers};
For body In {0 : 1}
  p[] = {}; h[] = {}; v[] = {}; cells~{body}[] = {};
  n = #columns~{body}[]; m = #rows~{body}[];
  For j In {0 : m - 1}
    For i In {0 : n - 1}
      q = newp; Point(q) = {columns~{body}[i], rows~{body}[j], 0}; p[] += q;
    EndFor
  EndFor
  For j In {0 : m - 1}
    For i In {0 : n - 2}
      l = newl; Line(l) = {p[i + n * j], p[i + 1 + n * j]}; h[] += l;
      Transfinite Curve{l} = across~{body}[i] + 1;
    EndFor
  EndFor
  For j In {0 : m - 2}
    For i In {0 : n - 1}
      open = (body == 1 && j == 1 && i > 1);        // where the ring is
      If(open)
        v[] += 0;
      Else
        l = newl; Line(l) = {p[i + n * j], p[i + n * (j + 1)]}; v[] += l;
        Transfinite Curve{l} = up~{body}[j] + 1;
      EndIf
    EndFor
  EndFor
  For j In {0 : m - 2}
    For i In {0 : n - 2}
      If(!(body == 1 && j == 1 && i > 0))
        c = newll; Curve Loop(c) = {h[i + (n - 1) * j], v[i + 1 + n * j], -h[i + (n - 1) * (j + 1)], -v[i + n * j]};
        s = news; Plane Surface(s) = {c}; cells~{body}[] += s;
      EndIf
    EndFor
  EndFor
  lines~{body}[] = h[]; uprights~{body}[] = v[];
EndFor

Transfinite Surface{:};
Recombine Surface{:};

Physical Surface("punch_body") = cells_0[];
Physical Curve("punch_contact_lower") = lines_0[0];
Physical Curve("punch_contact_upper") = lines_0[2];
Physical Surface("strip_body") = cells_1[];
Physical Curve("strip_contact") = {lines_1[5], lines_1[8]};
Physical Curve("strip_shaft") = {uprights_1[0], uprights_1[4], uprights_1[8]};
Physical Curve("punch_rims") = {uprights_0[0], uprights_0[2]};   // inside and outside: what acts here acts on the ring as a whole
