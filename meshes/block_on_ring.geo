// A block on a ring: a rectangular block and the upper part of a ring, in structured quadrilaterals that are even at
// the contact and grow away from it.
//
// Lengths in mm; x from the middle of the block, z up from the ring's axis, which lies at x = z = 0.
// Physical groups: every name starts with the body it belongs to, punch_ (the block) or strip_ (the ring).
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circle.

DefineConstant[
  radius = 17.5,                // of the ring
  ring_wall = 8,                // of its wall that is meshed, below radius
  ring_angle = 40,              // degrees to both sides that are meshed, at most 60
  block_length = 15.75,         // along the sliding
  block_height = 10.16,
  contact_width = 4,            // width with even elements, centred at x = 0: the scar must stay within it
  overlap = 0.1,                // how far the ring's contact reaches beyond
  elements_along_contact = 80,  // even, so that a node lies at x = 0
  growth = 0.3,                 // growth of the element size per length away from the contact
  diffusion_area = 0            // diffusivity over the angular speed of a strip that turns, mm²/rad; 0: not known
];

If(diffusion_area < 0)
  Error("diffusion_area must not be negative");
EndIf
If(radius <= 0 || ring_wall <= 0 || ring_wall >= radius || block_height <= 0 || contact_width <= 0 || overlap <= 0)
  Error("lengths must be positive, ring_wall smaller than radius");
EndIf
If(ring_angle <= 0 || ring_angle > 60 || contact_width / 2 + overlap >= 0.95 * radius * Sin(ring_angle * Pi / 180))
  Error("expected ring_angle in 0 to 60 degrees, and contact_width / 2 + overlap well within that part of the ring");
EndIf
If(block_length <= contact_width)
  Error("block_length must be larger than contact_width");
EndIf
If(elements_along_contact < 2 || elements_along_contact % 2 != 0 || growth <= 0)
  Error("elements_along_contact must be even and growth positive");
EndIf

half_width = contact_width / 2;
half_count = elements_along_contact / 2;
size = half_width / half_count;

// A line of length span whose elements grow from the size at its start gets Count elements in the progression Ratio:
//   Ratio = 1 + growth span / size over the whole line, Count = log Ratio / log(1 + growth), Ratio^(1 / Count) from one
//   element to the next.

// ---- Block: the contact and what lies beside it, on both sides of x = 0 ------------------------
Ratio = 1 + growth * block_height / size;
up_count = Ceil(Log(Ratio) / Log(1 + growth));
up_ratio = Ratio ^ (1 / up_count);
Ratio = 1 + growth * (block_length / 2 - half_width) / size;
beside_count = Ceil(Log(Ratio) / Log(1 + growth));
beside_ratio = Ratio ^ (1 / beside_count);

block[] = {}; punch_contact[] = {}; punch_free[] = {}; punch_sides[] = {}; punch_top[] = {};
p = newp; Point(p) = {0, radius, 0}; low_middle = p;
p = newp; Point(p) = {0, radius + block_height, 0}; high_middle = p;
l = newl; Line(l) = {low_middle, high_middle}; up_middle = l;
Transfinite Curve{l} = up_count + 1 Using Progression up_ratio;
distances[] = {half_width, block_length / 2};
For side In {0 : 1}
  low = low_middle; high = high_middle; inner = up_middle;
  For i In {0 : 1}
    x = (2 * side - 1) * distances[i];
    p = newp; Point(p) = {x, radius, 0}; outer_low = p;
    p = newp; Point(p) = {x, radius + block_height, 0}; outer_high = p;
    a = newl; Line(a) = {low, outer_low};
    b = newl; Line(b) = {high, outer_high};
    l = newl; Line(l) = {outer_low, outer_high};
    Transfinite Curve{l} = up_count + 1 Using Progression up_ratio;
    If(i == 0)
      Transfinite Curve{a, b} = half_count + 1;
      punch_contact[] += a;
    Else
      Transfinite Curve{a, b} = beside_count + 1 Using Progression beside_ratio;
      punch_free[] += a;
      punch_sides[] += l;
    EndIf
    punch_top[] += b;
    k = newll; Curve Loop(k) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {k}; block[] += s;
    low = outer_low; high = outer_high; inner = l;
  EndFor
EndFor

// ---- Ring: the contact, its overlap and the rest, on both sides of x = 0 -----------------------
o = newp; Point(o) = {0, 0, 0};
inner_radius = radius - ring_wall;
// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_area * contact_width / radius);
top_size = (layer > 0 && layer < size) ? layer : size;
Ratio = 1 + growth * ring_wall / top_size;
down_count = Ceil(Log(Ratio) / Log(1 + growth));
down_ratio = Ratio ^ (1 / down_count);
contact_angle = Asin(half_width / radius);
overlap_angle = Asin((half_width + overlap) / radius);
angles[] = {contact_angle, overlap_angle, ring_angle * Pi / 180};
overlap_count = Ceil(overlap / size);
Ratio = 1 + growth * (angles[2] - overlap_angle) * radius / size;
rest_count = Ceil(Log(Ratio) / Log(1 + growth));
rest_ratio = Ratio ^ (1 / rest_count);

ring[] = {}; strip_contact[] = {}; strip_free[] = {}; strip_ends[] = {}; strip_bottom[] = {};
p = newp; Point(p) = {0, radius, 0}; top_middle = p;
p = newp; Point(p) = {0, inner_radius, 0}; bottom_middle = p;
l = newl; Line(l) = {top_middle, bottom_middle}; down_middle = l;
Transfinite Curve{l} = down_count + 1 Using Progression down_ratio;
For side In {0 : 1}
  top = top_middle; bottom = bottom_middle; inner = down_middle;
  For i In {0 : 2}
    angle = (2 * side - 1) * angles[i];
    p = newp; Point(p) = {radius * Sin(angle), radius * Cos(angle), 0}; outer_top = p;
    p = newp; Point(p) = {inner_radius * Sin(angle), inner_radius * Cos(angle), 0}; outer_bottom = p;
    a = newl; Circle(a) = {top, o, outer_top};
    b = newl; Circle(b) = {bottom, o, outer_bottom};
    l = newl; Line(l) = {outer_top, outer_bottom};
    Transfinite Curve{l} = down_count + 1 Using Progression down_ratio;
    If(i == 0)
      Transfinite Curve{a, b} = half_count + 1;
      strip_contact[] += a;
    EndIf
    If(i == 1)
      Transfinite Curve{a, b} = overlap_count + 1;
      strip_contact[] += a;
    EndIf
    If(i == 2)
      Transfinite Curve{a, b} = rest_count + 1 Using Progression rest_ratio;
      strip_free[] += a;
      strip_ends[] += l;
    EndIf
    strip_bottom[] += b;
    k = newll; Curve Loop(k) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {k}; ring[] += s;
    top = outer_top; bottom = outer_bottom; inner = l;
  EndFor
EndFor

Transfinite Surface{:};
Recombine Surface{:};

// ---- The contract: named physical groups ------------------------------------------------------
Physical Surface("punch_body") = block[];
Physical Surface("strip_body") = ring[];
Physical Curve("punch_contact") = punch_contact[];
Physical Curve("punch_free") = punch_free[];
Physical Curve("punch_sides") = punch_sides[];
Physical Curve("punch_top") = punch_top[];
Physical Curve("strip_contact") = strip_contact[];
Physical Curve("strip_free") = strip_free[];
Physical Curve("strip_ends") = strip_ends[];
Physical Curve("strip_bottom") = strip_bottom[];      // the inner side of the ring's wall
