// Two cylinders on each other, mirror images to the last digit: their parts about the contact, up to the axes.
//
// Lengths in mm; x from the axes, z up from where they touch.
DefineConstant[
  radius = 8,
  strip_radius = 8,             // 1e5 and more: nearly flat
  width = 8,                    // of the meshed part of each
  contact_width = 2,
  elements_along_contact = 40,
  growth = 0.3
];

half_width = contact_width / 2;
half_count = elements_along_contact / 2;
size = half_width / half_count;
radii[] = {radius, strip_radius};
For body In {0 : 1}
  s = 1 - 2 * body; R = radii[body];
  parts[] = {}; contact[] = {}; sides[] = {}; free[] = {}; far[] = {};
  axis = newp; Point(axis) = {0, s * R, 0};
  low = newp; Point(low) = {0, 0, 0}; low_middle = low;
  up = newl; Line(up) = {low, axis}; up_middle = up;
  Ratio = 1 + growth * R / size;
  Count = Ceil(Log(Ratio) / Log(1 + growth));
  Ratio = Ratio ^ (1 / Count);
  Transfinite Curve{up} = Count + 1 Using Progression Ratio;
  rows = Count;
  For side In {0 : 1}
    inner_low = low_middle; inner_top = axis; inner = up_middle;
    distances[] = {half_width, width / 2};
    For i In {0 : 1}
      x = (2 * side - 1) * distances[i];
      p = newp; Point(p) = {x, s * (R - Sqrt(R^2 - x^2)), 0}; outer_low = p;
      p = newp; Point(p) = {x, s * R, 0}; outer_top = p;
      a = newl; Circle(a) = {inner_low, axis, outer_low};
      b = newl; Line(b) = {inner_top, outer_top};
      l = newl; Line(l) = {outer_low, outer_top};
      Transfinite Curve{l} = rows + 1 Using Progression Ratio;
      If(i == 0)
        Transfinite Curve{a, b} = half_count + 1;
        contact[] += a;
      Else
        row_ratio = Ratio;
        Ratio = 1 + growth * (width / 2 - half_width) / size;
        Count = Ceil(Log(Ratio) / Log(1 + growth));
        Ratio = Ratio ^ (1 / Count);
        Transfinite Curve{a, b} = Count + 1 Using Progression Ratio;
        Ratio = row_ratio;
        free[] += a;
        sides[] += l;
      EndIf
      far[] += b;
      c = newll; Curve Loop(c) = {a, l, -b, -inner};
      f = news; Plane Surface(f) = {c}; parts[] += f;
      inner_low = outer_low; inner_top = outer_top; inner = l;
    EndFor
  EndFor
  If(body == 0)
    Physical Surface("punch_body") = parts[];
    Physical Curve("punch_contact") = contact[];
    Physical Curve("punch_sides") = sides[];
    Physical Curve("punch_far") = far[];
  Else
    Physical Surface("strip_body") = parts[];
    Physical Curve("strip_contact") = contact[];
    Physical Curve("strip_sides") = sides[];
    Physical Curve("strip_far") = far[];
    Physical Point("strip_axis") = {axis};
  EndIf
EndFor
Transfinite Surface{:};
Recombine Surface{:};
