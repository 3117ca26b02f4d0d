// A shaft in two bushings, as solids. Structured hexahedra.
//
// Lengths in mm, angles in degrees; the shaft's axis is y, at x = z = 0, and the left bushing's middle lies at
// y = -span / 2, the right one's at span / 2, z up. Both bushings rest on the top of the shaft, which is pressed up.
// The elements are even within fine_angle of the top, and coarser beyond.
// Physical groups: every name starts with the body it belongs to, punch_ (the bushings) or strip_ (the shaft).
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circles.

DefineConstant[
  radius = 10,              // of the shaft
  clearance = 0.05,         // each bushing's bore has the radius + clearance
  wall = 5,                 // of the bushings
  shaft_wall = 6,           // of the part of the shaft that is meshed, below radius
  length_left = 16,         // of each bushing
  length_right = 16,
  span = 60,                // from the middle of one bushing to that of the other
  overhang = 10,            // of the shaft beyond each bushing
  offset = 0,               // by which the right bushing lies lower than the left one, below the clearance
  fine_angle = 60,          // to both sides, below 170
  fine_elements = 16,       // within fine_angle of both sides, even
  beyond_elements = 4,      // from there to the bottom, on each side
  along = 4,                // over each bushing's length
  between_elements = 4,     // of the shaft between the bushings, even
  overhang_elements = 2,
  wall_layers = 2,
  shaft_layers = 2
];

If(clearance < 0)
  Error("clearance must not be negative: the shaft would be larger than its bore");
EndIf
If(radius <= 0 || clearance >= 0.2 * radius || wall <= 0 || shaft_wall <= 0 || shaft_wall >= radius)
  Error("radius, wall and shaft_wall must be positive, shaft_wall and clearance small against radius");
EndIf
If(length_left <= 0 || length_right <= 0 || overhang <= 0 || length_left >= span || length_right >= span)
  Error("length_left, length_right and overhang must be positive, the lengths below span");
EndIf
If(Fabs(offset) > 2 * clearance)
  Error("offset must be at most twice the clearance: the shaft would not go through both bores");
EndIf
If(fine_angle <= 0 || fine_angle >= 170 || fine_elements < 2 || fine_elements % 2 || beyond_elements < 2)
  Error("fine_angle must lie between 0 and 170, fine_elements be even, beyond_elements at least 2");
EndIf
If(between_elements < 2 || between_elements % 2 || along < 1 || overhang_elements < 1 || wall_layers < 1 || shaft_layers < 1)
  Error("between_elements must be even, along, overhang_elements, wall_layers and shaft_layers at least 1");
EndIf

degree = Pi / 180;
angles[] = {fine_angle, (fine_angle + 180) / 2, 180};
counts[] = {fine_elements / 2, Ceil(beyond_elements / 2), Floor(beyond_elements / 2)};
lengths[] = {length_left, length_right};

// Sections: of the left bushing at its inner face, of the right one, and of the shaft at y = 0.
starts[] = {-(span - length_left) / 2, (span - length_right) / 2, 0};
heights[] = {-clearance, -clearance - offset, 0};
near[] = {radius + clearance, radius + clearance, radius};
far[] = {radius + clearance + wall, radius + clearance + wall, radius - shaft_wall};
layers[] = {wall_layers, wall_layers, shaft_layers};
For part In {0 : 2}
  y = starts[part]; z = heights[part]; faces~{part}[] = {};
  o = newp; Point(o) = {0, y, z};
  p = newp; Point(p) = {0, y, z + near[part]}; near_middle = p;
  p = newp; Point(p) = {0, y, z + far[part]}; far_middle = p; inside~{part} = p;
  l = newl; Line(l) = {near_middle, far_middle}; middle = l; Transfinite Curve{l} = layers[part] + 1;
  For side In {0 : 1}
    a0 = near_middle; b0 = far_middle; inner = middle;
    For i In {0 : 2}
      If(side == 1 && i == 2)    // the way around is closed
        a1 = a_closed; b1 = b_closed; l = l_closed;
      Else
        angle = (2 * side - 1) * angles[i] * degree;
        p = newp; Point(p) = {near[part] * Sin(angle), y, z + near[part] * Cos(angle)}; a1 = p;
        p = newp; Point(p) = {far[part] * Sin(angle), y, z + far[part] * Cos(angle)}; b1 = p;
        l = newl; Line(l) = {a1, b1}; Transfinite Curve{l} = layers[part] + 1;
        If(side == 0)
          a_closed = a1; b_closed = b1; l_closed = l;
        EndIf
      EndIf
      a = newl; Circle(a) = {a0, o, a1};
      b = newl; Circle(b) = {b0, o, b1};
      Transfinite Curve{a, b} = counts[i] + 1;
      k = newll; Curve Loop(k) = {a, l, -b, -inner};
      s = news; Plane Surface(s) = {k}; Transfinite Surface{s}; Recombine Surface{s};
      faces~{part}[] += s;
      a0 = a1; b0 = b1; inner = l;
    EndFor
  EndFor
EndFor

// Drawn out along y: the bushings in one piece each, the shaft to both sides through its bushing and beyond. Of the
// sides of a piece the first is the arc at the contact, the third that on the far side.
bushings[] = {}; shaft[] = {}; between[] = {}; bore[] = {};
For side In {0 : 1}
  sign = 2 * side - 1; near_face = Fabs(starts[side]);
  part[] = Extrude {0, sign * lengths[side], 0} { Surface{faces~{side}[]}; Layers{along}; Recombine; };
  ends~{side}[] = faces~{side}[]; contact~{side}[] = {}; outside~{side}[] = {};
  For k In {0 : 5}
    ends~{side}[] += part[6 * k]; bushings[] += part[6 * k + 1];
    contact~{side}[] += part[6 * k + 2]; outside~{side}[] += part[6 * k + 4];
  EndFor
  section[] = faces_2[];
  ways[] = {near_face, lengths[side], overhang};
  parts[] = {between_elements / 2, along, overhang_elements};
  For piece In {0 : 2}
    part[] = Extrude {0, sign * ways[piece], 0} { Surface{section[]}; Layers{parts[piece]}; Recombine; };
    section[] = {}; around~{piece}[] = {};
    For k In {0 : 5}
      section[] += part[6 * k]; shaft[] += part[6 * k + 1];
      around~{piece}[] += part[6 * k + 2]; bore[] += part[6 * k + 4];
    EndFor
  EndFor
  between[] += around_0[]; journal~{side}[] = around_1[]; beyond~{side}[] = around_2[]; tip~{side}[] = section[];
EndFor

// ---- The contract: named physical groups ------------------------------------------------------
Physical Volume("punch_bushings") = bushings[];
Physical Surface("punch_contact_left") = contact_0[];
Physical Surface("punch_contact_right") = contact_1[];
Physical Surface("punch_outside") = {outside_0[], outside_1[]};   // held by the housing
Physical Surface("punch_ends") = {ends_0[], ends_1[]};
Physical Volume("strip_shaft") = shaft[];
Physical Surface("strip_contact_left") = journal_0[];
Physical Surface("strip_contact_right") = journal_1[];
Physical Surface("strip_between") = between[];                    // what carries a wheel between the bushings
Physical Surface("strip_overhang_left") = beyond_0[];             // what carries one beyond them
Physical Surface("strip_overhang_right") = beyond_1[];
Physical Surface("strip_bore") = bore[];                          // inside the shaft
Physical Surface("strip_ends") = {tip_0[], tip_1[]};
Physical Point("strip_middle") = inside_2;                        // inside the shaft, below the middle of its top
