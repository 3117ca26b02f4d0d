// A punch on a strip: structured, graded quadrilaterals, finest at the edges of contact.
//
// Lengths in mm; x from the punch's centre, z up from the strip's bottom.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.
// The case file gives each parameter below a value of its own by name.

DefineConstant[
  punch_width = 60,             // along the sliding direction
  punch_height = 100,
  layer_height = 20,            // of the punch's lower material
  pin_height_1 = 20,            // of the pins above the contact surface
  pin_height_2 = 0,             // a second row of pins; 0: none
  pins_on_left_side = 0,        // 1: pins on both sides of the punch; 0: on the right side only
  strip_length = 1140,
  strip_height = 100,
  overlap = 0,                  // how far strip_contact reaches beyond the punch, for a strip that moves under it
  elements_along_contact = 16,  // even, so that a node lies at x = 0
  edge_grading = 4,             // element size in the middle of the contact over that at its edges
  growth = 0.5,                 // growth of the element size per length away from the contact
  diffusion_length = 0          // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(punch_width <= 0 || punch_height <= 0 || strip_height <= 0)
  Error("punch_width, punch_height and strip_height must be positive");
EndIf
If(layer_height <= 0 || layer_height >= punch_height)
  Error("layer_height must lie between 0 and punch_height");
EndIf
If(strip_length <= punch_width)
  Error("strip_length must be larger than punch_width");
EndIf
If(pin_height_1 <= 0 || pin_height_1 > punch_height || pin_height_2 < 0 || pin_height_2 > punch_height)
  Error("a pin is off the punch: pin_height_1 and pin_height_2 must not exceed punch_height");
EndIf
If(overlap < 0 || overlap >= (strip_length - punch_width) / 2)
  Error("overlap must not be negative, and strip_contact must end within the strip");
EndIf
If(elements_along_contact < 2 || elements_along_contact % 2 != 0 || edge_grading < 1 || growth <= 0)
  Error("elements_along_contact must be even, edge_grading at least 1 and growth positive");
EndIf

// ---- Element sizes -------------------------------------------------------------------------
// From the middle of the contact to its edge: half the elements, shrinking in geometric progression.
half_width = punch_width / 2;
half_count = elements_along_contact / 2;
contact_ratio = edge_grading ^ (-1 / ((half_count > 1) ? half_count - 1 : 1)); // both branches are evaluated: no 1 / 0
edge_size = 0;
For i In {0 : half_count - 1}
  edge_size += contact_ratio ^ (-i);
EndFor
edge_size = half_width / edge_size;

// Away from it the size grows linearly with the distance s, edge_size + growth s. A line between two
// distances gets Count elements in the progression Ratio, so that the layers continue each other.

// ---- Punch: columns left and right of x = 0, rows between the levels --------------------------
levels[] = {0, layer_height, pin_height_1, punch_height};
If(pin_height_2 > 0)
  levels[] += {pin_height_2};
EndIf
For i In {1 : #levels[] - 1}    // in ascending order
  For j In {#levels[] - 1 : i : -1}
    If(levels[j] < levels[j - 1])
      swapped = levels[j];
      levels[j] = levels[j - 1];
      levels[j - 1] = swapped;
    EndIf
  EndFor
EndFor

left[] = {}; middle[] = {}; right[] = {}; heights[] = {}; pins[] = {};
For i In {0 : #levels[] - 1}
  is_new = 1;
  If(i > 0)
    is_new = levels[i] > levels[i - 1] + 1e-9 * punch_height;
  EndIf
  If(is_new)
    z = strip_height + levels[i];
    p = newp; Point(p) = {-half_width, z, 0}; left[] += p;
    p = newp; Point(p) = {0, z, 0}; middle[] += p;
    p = newp; Point(p) = {half_width, z, 0}; right[] += p;
    heights[] += levels[i];
    on_row_1 = Fabs(levels[i] - pin_height_1) < 1e-9 * punch_height;
    on_row_2 = pin_height_2 > 0 && Fabs(levels[i] - pin_height_2) < 1e-9 * punch_height;
    If(on_row_1 || on_row_2)
      pins[] += right[#right[] - 1];
      If(pins_on_left_side)
        pins[] += left[#left[] - 1];
      EndIf
    EndIf
  EndIf
EndFor

across[] = {};    // two horizontal lines a level, each from the middle outwards
For i In {0 : #heights[] - 1}
  l = newl; Line(l) = {middle[i], left[i]}; across[] += l;
  l = newl; Line(l) = {middle[i], right[i]}; across[] += l;
EndFor
Transfinite Curve{across[]} = half_count + 1 Using Progression contact_ratio;

lower[] = {}; upper[] = {}; sides[] = {};
For i In {0 : #heights[] - 2}
  Ratio = (edge_size + growth * heights[i + 1]) / (edge_size + growth * heights[i]);
  Count = Ceil(Log(Ratio) / Log(1 + growth));
  Ratio = Ratio ^ (1 / Count);
  vl = newl; Line(vl) = {left[i], left[i + 1]};
  vm = newl; Line(vm) = {middle[i], middle[i + 1]};
  vr = newl; Line(vr) = {right[i], right[i + 1]};
  Transfinite Curve{vl, vm, vr} = Count + 1 Using Progression Ratio;
  sides[] += {vl, vr};
  c = newll; Curve Loop(c) = {-across[2 * i], vm, across[2 * i + 2], -vl};
  s = news; Plane Surface(s) = {c};
  c = newll; Curve Loop(c) = {across[2 * i + 1], vr, -across[2 * i + 3], -vm};
  t = news; Plane Surface(t) = {c};
  If(heights[i] < layer_height - 1e-9 * punch_height)
    lower[] += {s, t};
  Else
    upper[] += {s, t};
  EndIf
EndFor

// ---- Strip: under the punch, and on both sides of it ------------------------------------------
// Every line runs outwards from x = 0, as on the punch: mirror images and facing nodes agree to the last digit.
distances[] = {0, half_width};
If(overlap > 0)
  distances[] += {half_width + overlap};
EndIf
distances[] += {strip_length / 2};
// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * punch_width);
top_size = (layer > 0 && layer < edge_size) ? layer : edge_size;
Ratio = 1 + growth * strip_height / top_size;
deep_count = Ceil(Log(Ratio) / Log(1 + growth));
deep_ratio = Ratio ^ (1 / deep_count);

strip[] = {}; strip_contact[] = {}; strip_free[] = {}; bottom_lines[] = {}; strip_ends[] = {};
p = newp; Point(p) = {0, strip_height, 0}; middle_top = p;
p = newp; Point(p) = {0, 0, 0}; middle_bottom = p;
l = newl; Line(l) = {middle_top, middle_bottom}; middle_line = l;
Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
For side In {0 : 1}
  top = middle_top; bottom = middle_bottom; inner = middle_line;
  For i In {1 : #distances[] - 1}
    x = (2 * side - 1) * distances[i];
    p = newp; Point(p) = {x, strip_height, 0}; outer_top = p;
    p = newp; Point(p) = {x, 0, 0}; outer_bottom = p;
    a = newl; Line(a) = {top, outer_top};
    b = newl; Line(b) = {bottom, outer_bottom};
    l = newl; Line(l) = {outer_top, outer_bottom};
    Transfinite Curve{l} = deep_count + 1 Using Progression deep_ratio;
    If(i == 1)
      Transfinite Curve{a, b} = half_count + 1 Using Progression contact_ratio;
    Else
      from_edge = distances[i - 1] - half_width;
      Ratio = (edge_size + growth * (distances[i] - half_width)) / (edge_size + growth * from_edge);
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
    bottom_lines[] += b;
    c = newll; Curve Loop(c) = {a, l, -b, -inner};
    s = news; Plane Surface(s) = {c}; strip[] += s;
    top = outer_top; bottom = outer_bottom; inner = l;
  EndFor
EndFor

Transfinite Surface{:};
Recombine Surface{:};

// ---- The contract: named physical groups ------------------------------------------------------
Physical Surface("punch_lower") = lower[];
Physical Surface("punch_upper") = upper[];
Physical Surface("strip_body") = strip[];
Physical Curve("punch_contact") = {across[0], across[1]};
Physical Curve("punch_load") = {across[#across[] - 2], across[#across[] - 1]};
Physical Curve("punch_free") = sides[];
Physical Point("punch_pin") = pins[];
Physical Curve("strip_contact") = strip_contact[];
Physical Curve("strip_free") = strip_free[];
Physical Curve("strip_bottom") = bottom_lines[];
Physical Curve("strip_ends") = strip_ends[];
