// Two pads on both faces of a whole disc, as in a caliper, or both on its front; or one alone. Structured hexahedra.
//
// Lengths in mm, angles in degrees; the disc turns about z, its upper (front) face is z = 0, the pads' middles lie on x.
// Physical groups: every name starts with the body it belongs to, punch_ (the pads) or strip_ (the disc).

DefineConstant[
  inner_radius = 60,      // of the pads
  outer_radius = 100,
  front_angle = 50,       // of each pad, below 180
  back_angle = 50,        // 0: the front pad is alone
  same_face = 0,          // 1: the second pad lies on the front, too, opposite the first; it keeps its name
  pad_height = 10,
  disc_height = 20,
  bore_radius = 35,       // of the disc, where its hub holds it
  margin = 5,             // by which the rubbed faces are wider than the pads on each side
  across = 5,             // elements over the pads' width
  along = 8,              // elements over each pad's length
  around = 36,            // elements around the disc, a multiple of 3
  hub_elements = 3,       // over the width of the disc within the rubbed faces
  pad_layers = 2,         // elements over the height
  disc_layers = 4
];

If(bore_radius <= 0 || inner_radius - margin <= bore_radius || outer_radius <= inner_radius || margin <= 0)
  Error("expected 0 < bore_radius < inner_radius - margin, inner_radius < outer_radius, and a positive margin");
EndIf
If(pad_height <= 0 || disc_height <= 0)
  Error("pad_height and disc_height must be positive");
EndIf
If(front_angle <= 0 || front_angle >= 180 || back_angle < 0 || back_angle >= 180)
  Error("front_angle and back_angle must lie between 0 and 180");
EndIf
If(same_face && front_angle + back_angle >= 340)
  Error("on the same face front_angle and back_angle must add up to less than 340");
EndIf
If(across < 1 || along < 1 || around < 6 || around % 3 || hub_elements < 1 || pad_layers < 1 || disc_layers < 1)
  Error("across, along, hub_elements, pad_layers, disc_layers must be at least 1, around a multiple of 3, at least 6");
EndIf

// The pads: a line along the radius, turned and lifted.
pads[] = {};
two = (back_angle > 0);
For k In {0 : two}
  behind = (k == 1 && !same_face) ? 1 : 0; turn = (k == 1 && same_face) ? -1 : 1;    // -1: half a turn about z
  angle = ((k == 0) ? front_angle : back_angle) * Pi / 180; z = behind ? -disc_height : 0;
  p = newp;
  Point(p) = {turn * inner_radius * Cos(angle / 2), -turn * inner_radius * Sin(angle / 2), z};
  Point(p + 1) = {turn * outer_radius * Cos(angle / 2), -turn * outer_radius * Sin(angle / 2), z};
  l = newl; Line(l) = {p, p + 1};
  Transfinite Curve{l} = across + 1;
  face[] = Extrude {{0, 0, 1}, {0, 0, z}, angle} { Line{l}; Layers{along}; Recombine; };
  pad[] = Extrude {0, 0, behind ? -pad_height : pad_height} { Surface{face[1]}; Layers{pad_layers}; Recombine; };
  pads[] += pad[1]; rubbing~{k} = face[1]; plate~{k} = pad[0];
  ends~{k}[] = {pad[2], pad[4]}; sides~{k}[] = {pad[3], pad[5]};
EndFor

// The disc: its section, hub and rubbed part, turned by three thirds.
r[] = {bore_radius, inner_radius - margin, outer_radius + margin};
n[] = {hub_elements, across + 2};
q = newp;
For i In {0 : 2}
  Point(q + 2 * i) = {r[i], 0, -disc_height}; Point(q + 2 * i + 1) = {r[i], 0, 0};
EndFor
m = newl;
For i In {0 : 2}
  Line(m + i) = {q + 2 * i, q + 2 * i + 1};
  Transfinite Curve{m + i} = disc_layers + 1;
EndFor
For i In {0 : 1}
  Line(m + 3 + i) = {q + 2 * i, q + 2 * i + 2}; Line(m + 5 + i) = {q + 2 * i + 1, q + 2 * i + 3};
  Transfinite Curve{m + 3 + i, m + 5 + i} = n[i] + 1;
EndFor
disc[] = {}; front[] = {}; back[] = {}; bore[] = {}; round[] = {};
For i In {0 : 1}
  c = newll; Curve Loop(c) = {m + 3 + i, m + 1 + i, -(m + 5 + i), -(m + i)};
  s = news; Plane Surface(s) = {c};
  Transfinite Surface{s}; Recombine Surface{s};
  For third In {1 : 3}
    part[] = Extrude {{0, 0, 1}, {0, 0, 0}, 2 * Pi / 3} { Surface{s}; Layers{around / 3}; Recombine; };
    s = part[0]; disc[] += part[1];
    If(i == 0)
      bore[] += part[5];
    Else
      back[] += part[2]; round[] += part[3]; front[] += part[4];
    EndIf
  EndFor
EndFor
Coherence;

Physical Volume("punch_pads") = pads[];
Physical Surface("punch_contact_front") = rubbing_0;
Physical Surface("punch_front") = plate_0;
If(two)
  Physical Surface("punch_contact_back") = rubbing_1;
  Physical Surface("punch_back") = plate_1;
  Physical Surface("punch_sides") = {sides_0[], sides_1[]};
  Physical Surface("punch_ends") = {ends_0[], ends_1[]};
Else
  Physical Surface("punch_sides") = sides_0[];
  Physical Surface("punch_ends") = ends_0[];
EndIf
Physical Volume("strip_disc") = disc[];
Physical Surface("strip_contact_front") = front[];
If(same_face || !two)
  Physical Surface("strip_back") = back[];
Else
  Physical Surface("strip_contact_back") = back[];
EndIf
Physical Surface("strip_bore") = bore[];
Physical Surface("strip_rim") = round[];
