// A punch with rounded edges, and perhaps a crown, on a strip: structured quadrilaterals, finest where the flat ends.
//
// Lengths in mm; x from the punch's centre, z up from the strip's bottom.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circles.

DefineConstant[
  punch_width = 60,             // along the sliding direction, rounded edges included
  punch_height = 60,
  flat_width = 50,              // between the rounded edges
  edge_radius = 20,
  crown_radius = 0,             // of the part between the edges; 0: flat
  strip_length = 300,
  strip_height = 100,
  overlap = 0,                  // how far strip_contact reaches beyond, for a strip that moves under the punch
  elements_along_flat = 20,     // even, so that a node lies at x = 0
  elements_along_edge = 8,      // of each rounded edge
  flat_grading = 8,             // element size in the middle over that at the ends of the flat
  growth = 0.5,                 // growth of the element size per length away from the contact
  diffusion_length = 0          // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(flat_width <= 0 || flat_width >= punch_width || edge_radius <= 0 || crown_radius < 0)
  Error("expected 0 < flat_width < punch_width, a positive edge_radius and a crown_radius that is not negative");
EndIf
If(strip_length <= punch_width + 2 * overlap || overlap < 0 || strip_height <= 0)
  Error("strip_length must be larger than punch_width + 2 overlap, and strip_height positive");
EndIf
If(elements_along_flat < 2 || elements_along_flat % 2 != 0 || elements_along_edge < 1)
  Error("elements_along_flat must be even and elements_along_edge at least 1");
EndIf
If(flat_grading < 1 || growth <= 0)
  Error("flat_grading must be at least 1 and growth positive");
EndIf

// The edge's circle continues the crown's without a kink.
flat_end = flat_width / 2;
slope = 0;
crown_drop = 0;
If(crown_radius > 0)
  slope = Asin(flat_end / crown_radius);
  crown_drop = crown_radius * (1 - Cos(slope));
EndIf
centre_x = flat_end - edge_radius * Sin(slope);
steepest = (punch_width / 2 - centre_x) / edge_radius;
If(steepest > 0.6)
  Error("the rounded edges are steeper than the contact may be: expected a larger edge_radius or flat_width");
EndIf
centre_z = crown_drop + edge_radius * Cos(slope);
edge_drop = centre_z - edge_radius * Sqrt(1 - steepest^2);
If(punch_height <= 2 * edge_drop)
  Error("punch_height must be larger than twice what its edges rise");
EndIf

half_count = elements_along_flat / 2;
flat_ratio = flat_grading ^ (-1 / ((half_count > 1) ? half_count - 1 : 1)); // both branches are evaluated: no 1 / 0
size = 0;
For i In {0 : half_count - 1}
  size += flat_ratio ^ (-i);
EndFor
size = flat_end / size;         // of the last element of the flat

Ratio = 1 + growth * (punch_height - edge_drop) / size;
rows = Ceil(Log(Ratio) / Log(1 + growth));
row_ratio = Ratio ^ (1 / rows);

// ---- Punch: flat and rounded columns on both sides of x = 0 ------------------------------------
z = strip_height;
punch[] = {}; punch_contact[] = {}; punch_top[] = {}; punch_sides[] = {};
p = newp; Point(p) = {0, z, 0}; middle_low = p;
p = newp; Point(p) = {0, z + punch_height, 0}; middle_high = p;
l = newl; Line(l) = {middle_low, middle_high}; middle_line = l;
Transfinite Curve{l} = rows + 1 Using Progression row_ratio;
If(crown_radius > 0)
  p = newp; Point(p) = {0, z + crown_radius, 0}; crown_centre = p;
EndIf
For side In {0 : 1}
  d = 2 * side - 1;
  p = newp; Point(p) = {d * flat_end, z + crown_drop, 0}; flat_low = p;
  p = newp; Point(p) = {d * flat_end, z + punch_height, 0}; flat_high = p;
  p = newp; Point(p) = {d * centre_x, z + centre_z, 0}; edge_centre = p;
  p = newp; Point(p) = {d * punch_width / 2, z + edge_drop, 0}; edge_low = p;
  p = newp; Point(p) = {d * punch_width / 2, z + punch_height, 0}; edge_high = p;
  a = newl;
  If(crown_radius > 0)
    Circle(a) = {middle_low, crown_centre, flat_low};
  Else
    Line(a) = {middle_low, flat_low};
  EndIf
  b = newl; Line(b) = {middle_high, flat_high};
  c = newl; Circle(c) = {flat_low, edge_centre, edge_low};
  e = newl; Line(e) = {flat_high, edge_high};
  l = newl; Line(l) = {flat_low, flat_high};
  m = newl; Line(m) = {edge_low, edge_high};
  Transfinite Curve{a, b} = half_count + 1 Using Progression flat_ratio;
  Transfinite Curve{c, e} = elements_along_edge + 1;
  Transfinite Curve{l, m} = rows + 1 Using Progression row_ratio;
  k = newll; Curve Loop(k) = {a, l, -b, -middle_line};
  s = news; Plane Surface(s) = {k}; punch[] += s;
  k = newll; Curve Loop(k) = {c, m, -e, -l};
  s = news; Plane Surface(s) = {k}; punch[] += s;
  punch_contact[] += {a, c}; punch_top[] += {b, e}; punch_sides[] += m;
EndFor

// ---- Strip: the same columns, the overlap, and the rest ----------------------------------------
distances[] = {flat_end, punch_width / 2};
If(overlap > 0)
  distances[] += {punch_width / 2 + overlap};
EndIf
distances[] += {strip_length / 2};
// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * punch_width);
top_size = (layer > 0 && layer < size) ? layer : size;
Ratio = 1 + growth * strip_height / top_size;
deep_count = Ceil(Log(Ratio) / Log(1 + growth));
deep_ratio = Ratio ^ (1 / deep_count);
outer_size = (punch_width / 2 - flat_end) / elements_along_edge;

strip[] = {}; strip_contact[] = {}; strip_free[] = {}; strip_ends[] = {}; strip_bottom[] = {};
p = newp; Point(p) = {0, 0, 0}; middle_bottom = p;
p = newp; Point(p) = {0, strip_height, 0}; middle_surface = p;
l = newl; Line(l) = {middle_surface, middle_bottom}; middle_depth = l;
Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
For side In {0 : 1}
  top = middle_surface; bottom = middle_bottom; inner = middle_depth; before = 0;
  For i In {0 : #distances[] - 1}
    x = (2 * side - 1) * distances[i];
    p = newp; Point(p) = {x, strip_height, 0}; outer_top = p;
    p = newp; Point(p) = {x, 0, 0}; outer_bottom = p;
    a = newl; Line(a) = {top, outer_top};
    b = newl; Line(b) = {bottom, outer_bottom};
    l = newl; Line(l) = {outer_top, outer_bottom};
    Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
    If(i == 0)
      Transfinite Curve{a, b} = half_count + 1 Using Progression flat_ratio;
    EndIf
    If(i == 1)
      Transfinite Curve{a, b} = elements_along_edge + 1;
    EndIf
    If(i > 1)
      from_edge = before - punch_width / 2;
      Ratio = (outer_size + growth * (distances[i] - punch_width / 2)) / (outer_size + growth * from_edge);
      Count = Ceil(Log(Ratio) / Log(1 + growth));
      Ratio = Ratio ^ (1 / Count);
      Transfinite Curve{a, b} = Count + 1 Using Progression Ratio;
    EndIf
    If(i < #distances[] - 1)
      strip_contact[] += a;
    Else
      strip_free[] += a;
      strip_ends[] += l;
    EndIf
    strip_bottom[] += b;
    k = newll; Curve Loop(k) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {k}; strip[] += s;
    top = outer_top; bottom = outer_bottom; inner = l; before = distances[i];
  EndFor
EndFor

Transfinite Surface{:};
Recombine Surface{:};

// ---- The contract: named physical groups ------------------------------------------------------
Physical Surface("punch_body") = punch[];
Physical Surface("strip_body") = strip[];
Physical Curve("punch_contact") = punch_contact[];
Physical Curve("punch_top") = punch_top[];
Physical Curve("punch_sides") = punch_sides[];
Physical Curve("strip_contact") = strip_contact[];
Physical Curve("strip_free") = strip_free[];
Physical Curve("strip_ends") = strip_ends[];
Physical Curve("strip_bottom") = strip_bottom[];
