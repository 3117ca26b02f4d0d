// Two shoes in a drum, hinged below, which a wheel cylinder presses apart above. Structured quadrilaterals.
//
// Lengths in mm, angles in degrees; the drum's axis lies at x = z = 0, z up. Angles of a shoe count from its hinge, upwards.
// Physical groups: every name starts with the body it belongs to, punch_ (the shoes) or strip_ (the drum).
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circles.

DefineConstant[
  drum_radius = 150,           // inside
  drum_wall = 15,
  clearance = 0,               // between drum and linings at the start, about the drum's axis
  hinge_radius = 122.7,        // of the hinges, from the drum's axis
  hinge_angle = 24,            // from straight below to each hinge
  lining_from = 10,            // where the linings begin, and end
  lining_to = 120,
  shoe_to = 126,               // where the shoes end
  lining_thickness = 6,
  elements_along_lining = 48,
  elements_along_drum = 180,   // a multiple of 4
  lining_layers = 2,
  shoe_layers = 4,
  drum_layers = 3
];

If(drum_radius <= 0 || drum_wall <= 0 || clearance < 0 || lining_thickness <= 0)
  Error("drum_radius, drum_wall and lining_thickness must be positive, clearance at least 0");
EndIf
If(hinge_radius <= 0 || hinge_radius >= drum_radius - clearance - lining_thickness)
  Error("hinge_radius must be positive, and the hinges within the linings");
EndIf
If(lining_from < 0 || lining_to <= lining_from || shoe_to < lining_to || hinge_angle <= 0 || hinge_angle + shoe_to >= 180)
  Error("expected 0 <= lining_from < lining_to <= shoe_to, and hinge_angle + shoe_to below 180");
EndIf
If(elements_along_lining < 1 || elements_along_drum < 8 || elements_along_drum % 4 != 0)
  Error("elements_along_lining must be at least 1, elements_along_drum a multiple of 4");
EndIf
If(lining_layers < 1 || shoe_layers < 1 || drum_layers < 1)
  Error("lining_layers, shoe_layers and drum_layers must be at least 1");
EndIf

degree = Pi / 180;
size = (lining_to - lining_from) / elements_along_lining;
o = newp; Point(o) = {0, 0, 0};

// The shoes: sectors from the hinge on, 0 the right one and 1 the left one; the lining lies on the middle sector.
r[] = {hinge_radius, drum_radius - clearance - lining_thickness, drum_radius - clearance};
cuts[] = {0};
If(lining_from > 0)
  cuts[] += lining_from;
EndIf
cuts[] += lining_to;
If(shoe_to > lining_to)
  cuts[] += shoe_to;
EndIf
For side In {0 : 1}
  sign = 1 - 2 * side;
  shoe~{side}[] = {}; rim~{side}[] = {};
  For i In {0 : #cuts[] - 1}
    angle = -Pi / 2 + (hinge_angle + cuts[i]) * degree;
    For k In {0 : 2}
      lined = (cuts[i] == lining_from || cuts[i] == lining_to) ? 1 : 0;
      If(k < 2 || lined)
        p = newp; Point(p) = {sign * r[k] * Cos(angle), r[k] * Sin(angle), 0}; here~{k} = p;
      EndIf
    EndFor
    l = newl; Line(l) = {here_0, here_1}; Transfinite Curve{l} = shoe_layers + 1; radial = l;
    If(lined)
      l = newl; Line(l) = {here_1, here_2}; Transfinite Curve{l} = lining_layers + 1; outer = l;
    Else
      here_2 = here_1; outer = radial;
    EndIf
    If(i == 0)
      hinge~{side} = here_0;
      heel~{side} = radial;
    Else
      count = Ceil((cuts[i] - cuts[i - 1]) / size - 1e-6);
      For k In {0 : 1}
        l = newl; Circle(l) = {before~{k}, o, here~{k}}; Transfinite Curve{l} = count + 1; arc~{k} = l;
      EndFor
      c = newll; Curve Loop(c) = {arc_0, radial, -arc_1, -radial_before};
      s = news; Plane Surface(s) = {c}; shoe~{side}[] += s;
      rim~{side}[] += arc_0;
      If(cuts[i] == lining_to)
        l = newl; Circle(l) = {before_2, o, here_2}; Transfinite Curve{l} = count + 1; rubbing~{side} = l;
        c = newll; Curve Loop(c) = {arc_1, outer, -rubbing~{side}, -outer_before};
        s = news; Plane Surface(s) = {c}; lining~{side} = s;
      EndIf
    EndIf
    toe~{side} = radial;
    before_0 = here_0; before_1 = here_1; before_2 = here_2; radial_before = radial; outer_before = outer;
  EndFor
EndFor

// The drum: four quarters.
drum[] = {}; inside[] = {}; outside[] = {};
q = newp;
For i In {0 : 3}
  angle = i * Pi / 2;
  Point(q + 2 * i) = {drum_radius * Cos(angle), drum_radius * Sin(angle), 0};
  Point(q + 2 * i + 1) = {(drum_radius + drum_wall) * Cos(angle), (drum_radius + drum_wall) * Sin(angle), 0};
EndFor
m = newl;
For i In {0 : 3}
  j = (i + 1) % 4;
  Line(m + i) = {q + 2 * i, q + 2 * i + 1}; Transfinite Curve{m + i} = drum_layers + 1;
  Circle(m + 4 + i) = {q + 2 * i, o, q + 2 * j}; Circle(m + 8 + i) = {q + 2 * i + 1, o, q + 2 * j + 1};
  Transfinite Curve{m + 4 + i, m + 8 + i} = elements_along_drum / 4 + 1;
EndFor
For i In {0 : 3}
  j = (i + 1) % 4;
  c = newll; Curve Loop(c) = {m + i, m + 8 + i, -(m + j), -(m + 4 + i)};
  s = news; Plane Surface(s) = {c}; drum[] += s;
  inside[] += m + 4 + i; outside[] += m + 8 + i;
EndFor

Transfinite Surface{:};
Recombine Surface{:};

// ---- The contract: named physical groups ------------------------------------------------------
Physical Surface("punch_shoes") = {shoe_0[], shoe_1[]};
Physical Surface("punch_linings") = {lining_0, lining_1};
Physical Curve("punch_contact_right") = rubbing_0;
Physical Curve("punch_contact_left") = rubbing_1;
Physical Point("punch_hinge_right") = hinge_0;
Physical Point("punch_hinge_left") = hinge_1;
Physical Curve("punch_toe_right") = toe_0;            // the upper end, which the wheel cylinder presses
Physical Curve("punch_toe_left") = toe_1;
Physical Curve("punch_rims") = {rim_0[], rim_1[]};
Physical Surface("strip_drum") = drum[];
Physical Curve("strip_contact") = inside[];
Physical Curve("strip_outside") = outside[];
