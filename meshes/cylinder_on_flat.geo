// A cylinder on a flat: the lower part of the cylinder and a block, in structured quadrilaterals that are
// even at the contact and grow away from it.
//
// Lengths in mm; x from the cylinder's axis, z up from the flat's bottom.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circle.

DefineConstant[
  radius = 6,
  punch_width = 8,              // of the part of the cylinder that is meshed, up to its axis
  strip_length = 12,
  strip_height = 6,
  contact_width = 0.6,          // width with even elements, centred at x = 0: the scar must stay within it
  overlap = 0.05,               // how far strip_contact reaches beyond, for a flat that moves under the cylinder
  elements_along_contact = 60,  // even, so that a node lies at x = 0
  growth = 0.3,                 // growth of the element size per length away from the contact
  diffusion_length = 0          // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(radius <= 0 || strip_height <= 0 || contact_width <= 0 || overlap < 0)
  Error("radius, strip_height and contact_width must be positive, and overlap not negative");
EndIf
If(punch_width <= contact_width || punch_width >= 1.9 * radius || strip_length <= contact_width + 2 * overlap)
  Error("expected contact_width < punch_width < 1.9 radius, and strip_length > contact_width + 2 overlap");
EndIf
If(elements_along_contact < 2 || elements_along_contact % 2 != 0 || growth <= 0)
  Error("elements_along_contact must be even and growth positive");
EndIf

half_width = contact_width / 2;
half_count = elements_along_contact / 2;
size = half_width / half_count;
top_z = strip_height + radius;

// A line of length span whose elements grow from the size at its start gets Count elements in the progression Ratio:
//   Ratio = 1 + growth span / size over the whole line, Count = log Ratio / log(1 + growth), Ratio^(1 / Count) from one
//   element to the next.

// ---- Cylinder: columns of the contact and beside it, from the circle up to the axis ------------
axis = newp; Point(axis) = {0, top_z, 0};
punch[] = {}; punch_contact[] = {}; punch_sides[] = {}; punch_free[] = {}; punch_top[] = {};
low = newp; Point(low) = {0, strip_height, 0}; low_middle = low;
up = newl; Line(up) = {low, axis}; up_middle = up;
Ratio = 1 + growth * radius / size;
Count = Ceil(Log(Ratio) / Log(1 + growth));
Ratio = Ratio ^ (1 / Count);
Transfinite Curve{up} = Count + 1 Using Progression Ratio;
rows = Count;
For side In {0 : 1}
  inner_low = low_middle; inner_top = axis; inner = up_middle;
  distances[] = {half_width, punch_width / 2};
  For i In {0 : 1}
    x = (2 * side - 1) * distances[i];
    p = newp; Point(p) = {x, top_z - Sqrt(radius^2 - x^2), 0}; outer_low = p;
    p = newp; Point(p) = {x, top_z, 0}; outer_top = p;
    a = newl; Circle(a) = {inner_low, axis, outer_low};
    b = newl; Line(b) = {inner_top, outer_top};
    l = newl; Line(l) = {outer_low, outer_top};
    Transfinite Curve{l} = rows + 1 Using Progression Ratio;
    If(i == 0)
      Transfinite Curve{a, b} = half_count + 1;
      punch_contact[] += a;
    Else
      row_ratio = Ratio;
      Ratio = 1 + growth * (punch_width / 2 - half_width) / size;
      Count = Ceil(Log(Ratio) / Log(1 + growth));
      Ratio = Ratio ^ (1 / Count);
      Transfinite Curve{a, b} = Count + 1 Using Progression Ratio;
      Ratio = row_ratio;
      punch_free[] += a;
      punch_sides[] += l;
    EndIf
    punch_top[] += b;
    c = newll; Curve Loop(c) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {c}; punch[] += s;
    inner_low = outer_low; inner_top = outer_top; inner = l;
  EndFor
EndFor

// ---- Flat: under the contact, the overlap, and the rest ---------------------------------------
reaches[] = {half_width};
If(overlap > 0)
  reaches[] += {half_width + overlap};
EndIf
reaches[] += {strip_length / 2};
strip[] = {}; strip_contact[] = {}; strip_free[] = {}; strip_ends[] = {}; strip_bottom[] = {};
p = newp; Point(p) = {0, strip_height, 0}; middle_top = p;
p = newp; Point(p) = {0, 0, 0}; middle_bottom = p;
l = newl; Line(l) = {middle_top, middle_bottom}; middle_line = l;
// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * contact_width);
top_size = (layer > 0 && layer < size) ? layer : size;
Ratio = 1 + growth * strip_height / top_size;
deep_count = Ceil(Log(Ratio) / Log(1 + growth));
deep_ratio = Ratio ^ (1 / deep_count);
Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
For side In {0 : 1}
  top = middle_top; bottom = middle_bottom; inner = middle_line;
  For i In {0 : #reaches[] - 1}
    x = (2 * side - 1) * reaches[i];
    p = newp; Point(p) = {x, strip_height, 0}; outer_top = p;
    p = newp; Point(p) = {x, 0, 0}; outer_bottom = p;
    a = newl; Line(a) = {top, outer_top};
    b = newl; Line(b) = {bottom, outer_bottom};
    l = newl; Line(l) = {outer_top, outer_bottom};
    Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
    If(i == 0)
      Transfinite Curve{a, b} = half_count + 1;
    EndIf
    If(i > 0 && i < #reaches[] - 1)
      Transfinite Curve{a, b} = Ceil(overlap / size) + 1;
    EndIf
    If(i == #reaches[] - 1)
      Ratio = 1 + growth * (reaches[i] - reaches[i - 1]) / size;
      Count = Ceil(Log(Ratio) / Log(1 + growth));
      Ratio = Ratio ^ (1 / Count);
      Transfinite Curve{a, b} = Count + 1 Using Progression Ratio;
      strip_free[] += a;
      strip_ends[] += l;
    Else
      strip_contact[] += a;
    EndIf
    strip_bottom[] += b;
    c = newll; Curve Loop(c) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {c}; strip[] += s;
    top = outer_top; bottom = outer_bottom; inner = l;
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
Physical Curve("punch_free") = punch_free[];
Physical Curve("strip_contact") = strip_contact[];
Physical Curve("strip_free") = strip_free[];
Physical Curve("strip_ends") = strip_ends[];
Physical Curve("strip_bottom") = strip_bottom[];
